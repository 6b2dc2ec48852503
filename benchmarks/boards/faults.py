"""Boards with one fault each, and the reasons that name it."""

from collections.abc import Callable

import numpy as np

from benchmarks.boards.looks import Drawing, Lens, Plane, hung
from benchmarks.boards.trials import (
    Board,
    Trial,
    drawn,
    inside,
    large_enough,
    narrowest_px,
    picture,
    places,
    some_lens,
    widths_px,
)
from rig.targets import CharucoBoard
from rig.targets.checkerboard import Checkerboard

Random = np.random.Generator
View = tuple[Lens, Plane]


def _in_view(random: Random, target: Board, low_px: float, high_px: float) -> View:
    """A lens and a place at which all of a board is seen, squares so large."""
    while True:
        lens = some_lens(random, wide=random.random() < 0.3)
        towards = (
            float(random.uniform(0, 0.5) * lens.across_deg / 2),
            float(random.uniform(0, 360)),
        )
        tilt = (*random.uniform(-35, 35, 2), float(random.uniform(-180, 180)))
        side_px = float(random.uniform(low_px, high_px))
        plane = hung(towards, tuple(tilt), lens.focal_px / side_px)  # pyright: ignore
        outline = lens.shown(plane.points(places(target, ring=1)))
        if inside(lens, outline, 3.0).all():
            narrow_px = narrowest_px(lens, plane, target)
            if np.isfinite(narrow_px) and (narrow_px >= 0.7 * low_px):
                return lens, plane


def _usual(random: Random, target: Board) -> View:
    while True:
        view = _in_view(random, target, 14.0, 60.0)
        if large_enough(target, widths_px(*view, target)).all():
            return view


def _trial(kind: str, target: Board, image: np.ndarray, view: View | None, *reasons: str) -> Trial:
    corners = None
    if view is not None:
        corners = view[0].shown(view[1].points(places(target))).reshape(-1, 2)
    return Trial(kind, target, image, corners, reasons)


def other_count(random: Random, target: Board) -> Trial:
    """A board with a row or column less or more."""
    change = [(1, 0), (0, 1), (-1, 0), (0, -1), (2, -1), (2, 2)][int(random.integers(6))]
    other: Board
    if isinstance(target, CharucoBoard):
        # Rows more or less do not change the numbers of the others: such a board is a part of it.
        other = target.with_changes(
            squares_across=target.squares_across + int(random.choice((-2, -1, 1, 2))),
            dictionary=f"{target.dictionary[:3]}_1000",
        )
    else:
        size = max(target.columns + change[0], 3), max(target.rows + change[1], 3)
        other = Checkerboard(*size, target.square_mm)
    view = _usual(random, other)
    return _trial("other-count", target, picture(random, view[0], (drawn(other), view[1])), None,
                  "wrong-count")  # fmt: skip


def clipped(random: Random, target: Board) -> Trial:
    """A board of which some lines of corners are out of the picture."""
    while True:
        lens, plane = _usual(random, target)
        way = float(random.uniform(0, 2 * np.pi))
        far = float(random.uniform(0.3, 1.3)) * lens.width / lens.focal_px * plane.middle[2]
        moved = plane.middle + np.array([np.cos(way), np.sin(way), 0.0]) * far
        plane = Plane(plane.across, plane.down, moved)
        corners = lens.shown(plane.points(places(target)))
        seen = inside(lens, corners, 0.0) & np.isfinite(corners).all(axis=-1)
        seen &= plane.points(places(target))[..., 2] > 0
        if np.cross(plane.across, plane.down) @ moved <= 0:
            continue  # Its back.
        if 0.15 < seen.mean() < 0.85:
            break
    image = picture(random, lens, (drawn(target), plane))
    seen = inside(lens, corners, 6.0) & large_enough(target, widths_px(lens, plane, target))
    return _trial("clipped", target, image, (lens, plane), *_reasons_of_part(target, seen))


def covered(random: Random, target: Board) -> Trial:
    """A sheet of one grey level over a few squares up to all but a line of them."""
    lens, plane = _usual(random, target)
    half = np.array([target.columns + 1, target.rows + 1]) / 2
    share, side = float(random.uniform(0.05, 0.5)), int(random.integers(4))
    size = np.array([2 * half[0] + 4, 2 * half[1] + 4])
    axis = side % 2
    size[axis] = 2 * half[axis] * share + 4
    shift = np.zeros(2)
    shift[axis] = (1 if side < 2 else -1) * (half[axis] + 2 - size[axis] / 2)
    sheet = np.full((int(size[1] * 8), int(size[0] * 8)), random.integers(10, 250), np.uint8)
    before = Plane(plane.across, plane.down, plane.points(shift) * 0.98)
    image = picture(random, lens, (drawn(target), plane), (Drawing(sheet, 8.0 / 0.98), before))
    open_to = np.abs(places(target) - shift)[..., axis] > size[axis] / 2 + 0.5
    return _trial("covered", target, image, (lens, plane), *_reasons_of_part(target, open_to))


def _reasons_of_part(target: Board, seen: np.ndarray) -> tuple[str, ...]:
    """Right reasons where only some corners are seen: so few as chance brings are not found."""
    reasons = ("clipped", "which-part", "few-corners")
    if isinstance(target, CharucoBoard):
        return (*reasons, "not-found") if seen.sum() < 6 else reasons
    nothing = all(
        seen[row : row + 3, column : column + 3].sum() < 9
        for row in range(target.rows - 2)
        for column in range(target.columns - 2)
    )
    return (*reasons, "not-found") if nothing else reasons


def small(random: Random, target: Board) -> Trial:
    """Squares that are smaller than can be measured."""
    low, high = (3.0, 5.5)
    if isinstance(target, CharucoBoard):
        bit = target.marker_share / target.bits_across
        low, high = 5.0, 0.85 / bit
    lens, plane = _in_view(random, target, low, high)
    return _trial("small", target, picture(random, lens, (drawn(target), plane), blur_px=0.6),
                  (lens, plane), "too-small")  # fmt: skip


def blurred(random: Random, target: Board) -> Trial:
    """Out of focus, so that edges run together."""
    lens, plane = _usual(random, target)
    share = float(random.uniform(0.24, 0.45))
    if isinstance(target, CharucoBoard):
        share = float(random.uniform(0.15, 0.35))
    blur_px = share * narrowest_px(lens, plane, target)
    image = picture(random, lens, (drawn(target), plane), blur_px=blur_px)
    return _trial("blurred", target, image, (lens, plane), "blurred")


def dark(random: Random, target: Board) -> Trial:
    """Far too short an exposure."""
    lens, plane = _usual(random, target)
    gain = float(random.uniform(0.0, 0.03))
    image = picture(random, lens, (drawn(target), plane), gain=gain)
    return _trial("dark", target, image, (lens, plane), "under-exposed")


def burnt(random: Random, target: Board) -> Trial:
    """Far too long an exposure: black is white as well."""
    lens, plane = _usual(random, target)
    lift = float(random.uniform(240, 300))
    image = picture(random, lens, (drawn(target), plane), lift=lift)
    return _trial("burnt", target, image, (lens, plane), "over-exposed")


def absent(random: Random, target: Board) -> Trial:
    """Nothing but what is behind."""
    image = picture(random, some_lens(random, wide=False))
    return _trial("absent", target, image, None, "not-found")


def other_dictionary(random: Random, target: Board) -> Trial:
    """The same layout with other markers; without markers for a checkerboard: of other count."""
    if not isinstance(target, CharucoBoard):
        return other_count(random, target)
    names = [name for name in ("4X4_250", "5X5_250", "6X6_250", "APRILTAG_36H11")
             if name[:3] != target.dictionary[:3]]  # fmt: skip
    name = names[int(random.integers(len(names)))]
    other = target.with_changes(dictionary=name)
    view = _usual(random, other)
    image = picture(random, view[0], (drawn(other), view[1]))
    return _trial("other-dictionary", target, image, None, "wrong-dictionary")


def other_pattern(random: Random, target: Board) -> Trial:
    """White on black; for a checkerboard, one of other count."""
    if not isinstance(target, CharucoBoard):
        return other_count(random, target)
    other = target.with_changes(inverted=True)
    view = _usual(random, other)
    image = picture(random, view[0], (drawn(other), view[1]))
    return _trial("other-pattern", target, image, None, "wrong-pattern")


FAULTS: tuple[Callable[[Random, Board], Trial], ...] = (
    other_count, clipped, covered, small, blurred, dark, burnt, absent, other_dictionary,
    other_pattern,
)  # fmt: skip


def faulty_board(number: int, seed: int, target: Board) -> Trial:
    """A board with the fault whose turn it is."""
    random = np.random.default_rng((seed, 3, number))
    return FAULTS[number % len(FAULTS)](random, target)
