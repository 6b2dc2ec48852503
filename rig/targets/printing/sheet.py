"""A board on a page, with what tells whether it was printed at true size."""

import re
from itertools import pairwise

from rig.errors import ConfigError
from rig.targets import AprilGrid, CharucoBoard, CircleGrid, Target
from rig.targets.checkerboard import Checkerboard
from rig.targets.printing.board_areas import board_areas, board_size_mm
from rig.targets.printing.drawing import Area, Drawing, Line, Rect

PAGES_MM: dict[str, tuple[float, float]] = {
    "a4": (210.0, 297.0),
    "a3": (297.0, 420.0),
    "a2": (420.0, 594.0),
    "letter": (215.9, 279.4),
    "tabloid": (279.4, 431.8),
}
"""ISO 216 and ANSI sizes, width and height."""

RULER_MM = 100.0
_FOOT_MM = 17.0
"""Height of ruler and text under the board."""
_TEXT_MM = 2.6
_TICK_MM = 2.0
_HAIR_MM = 0.2


def page_mm(name: str) -> tuple[float, float]:
    """Return width and height of a page by name, or of `WIDTHxHEIGHT` in mm.

    Raises:
        ConfigError: neither.
    """
    if name.lower() in PAGES_MM:
        return PAGES_MM[name.lower()]
    match = re.fullmatch(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)", name.lower())
    if match is None:
        raise ConfigError(
            f"page {name} asked for",
            advice=f"there are {', '.join(PAGES_MM)}, or WIDTHxHEIGHT in mm",
        )
    return float(match[1]), float(match[2])


def draw_sheet(target: Target, page: tuple[float, float], border_mm: float) -> Drawing:
    """Put a board in the middle of a page, upright or across, whichever it fits.

    Args:
        target: the board.
        page: width and height, mm.
        border_mm: what the printer leaves white on all sides.

    Raises:
        ConfigError: the board does not fit; the message says what would.
    """
    board_mm = board_size_mm(target)
    ground_mm = 0.0
    if isinstance(target, CharucoBoard) and target.inverted:
        ground_mm = target.square_mm / 2
    needed_mm = (
        max(board_mm[0] + 2 * ground_mm, RULER_MM) + 2 * border_mm,
        board_mm[1] + 2 * ground_mm + _FOOT_MM + 2 * border_mm,
    )
    is_wide = board_mm[0] > board_mm[1]
    turns = sorted((page, page[::-1]), key=lambda p: (p[0] > p[1]) != is_wide)
    size = next((p for p in turns if needed_mm[0] <= p[0] and needed_mm[1] <= p[1]), None)
    if size is None:
        raise ConfigError(
            f"a board of {board_mm[0]:g} x {board_mm[1]:g} mm with its ruler needs a page of "
            f"{needed_mm[0]:g} x {needed_mm[1]:g} mm, {page[0]:g} x {page[1]:g} mm asked for",
            advice="take a larger --page or smaller squares",
        )
    x_mm = (size[0] - board_mm[0]) / 2
    y_mm = border_mm + ground_mm + (size[1] - needed_mm[1]) / 2
    foot_mm = y_mm + board_mm[1] + ground_mm
    ruler_mm = (size[0] - RULER_MM) / 2
    lines = [
        Line(ruler_mm, foot_mm + 10.0 + 3.2 * number, _TEXT_MM, text)
        for number, text in enumerate(_text(target))
    ]
    areas = (*board_areas(target, x_mm, y_mm), _ruler(ruler_mm, foot_mm + 3.0))
    return Drawing(size[0], size[1], areas, tuple(lines), f"{_kind(target)} {target}")


def _kind(target: Target) -> str:
    match target:
        case Checkerboard():
            return "checkerboard"
        case CharucoBoard():
            return "ChArUco"
        case AprilGrid():
            return "AprilGrid"
        case CircleGrid():
            return "circles"


def _what(target: Target) -> str:
    match target:
        case Checkerboard():
            return f"checkerboard, {target} inner corners, squares of {target.square_mm:g} mm"
        case CharucoBoard():
            return (
                f"ChArUco {target} squares of {target.square_mm:g} mm, markers "
                f"{target.marker_mm:g} mm {target.dictionary}"
                f"{', inverted' if target.inverted else ''}"
                f"{', legacy pattern' if target.legacy_pattern else ''}"
            )
        case AprilGrid():
            last = target.first_tag + target.tag_count - 1
            return (
                f"AprilGrid {target} tags 36h11 of {target.tag_mm:g} mm, spacing "
                f"{target.spacing:g}, border {target.border_bits}, numbers "
                f"{target.first_tag}..{last}"
            )
        case CircleGrid():
            return (
                f"{target} circles of {target.diameter_mm:g} mm, rows {target.spacing_mm:g} mm "
                "apart and shifted in turn"
            )


def _text(target: Target) -> tuple[str, ...]:
    width_mm, height_mm = board_size_mm(target)
    return (
        f"{_what(target)}; board {width_mm:g} x {height_mm:g} mm",
        f"Print at 100 % (no fit to page): the ruler above must be {RULER_MM:g} mm long.",
    )


def _ruler(x_mm: float, y_mm: float) -> Area:
    """A line of 100 mm from the outer edge of its first tick to that of its last."""
    ticks = [
        Rect(
            min(max(x_mm + 10 * n - _HAIR_MM / 2, x_mm), x_mm + RULER_MM - _HAIR_MM),
            y_mm,
            _HAIR_MM,
            _TICK_MM * (1.0 if n % 5 else 1.6),
        )
        for n in range(11)
    ]
    spans = [
        Rect(one.x_mm + _HAIR_MM, y_mm, other.x_mm - one.x_mm - _HAIR_MM, _HAIR_MM)
        for one, other in pairwise(ticks)
    ]
    return Area("black", (*ticks, *spans))
