"""Find the inner corners of a checkerboard, or say why they cannot be found.

The work is bounded by structure, so a black, noisy or adversarial picture costs no more than a
few passes over it: at most `MAX_SADDLES` points per resolution, three resolutions, one walk over
their links, a fixed number of steps per corner.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import TargetError
from rig.geometry.homography import fit_homography, grid_places, map_points
from rig.targets.checkerboard import Checkerboard
from rig.targets.checkerboard_diagnosis import MAX_BLUR_RATIO, MIN_SIDE_PX, why_not
from rig.targets.corner_fit import CrossingFit, fit_crossings
from rig.targets.lattice import Lattice, cut_to_size, grow_lattices
from rig.targets.pyramid import Image, at_level, from_level, pyramid, search_order
from rig.targets.saddles import find_saddles
from rig.targets.smooth_lines import smooth_triples

_LEVELS = 3
_SMOOTH_PX = 1.0
_RING_PX = 3.5
_SHARP_PX, _BLURRED_PX = 1.0, 2.5
"""Blur of the picture in which corners are measured best, where there is a finer or coarser one."""
_MIN_FOUND = 0.85
"""Share of the corners that must be seen before the missing ones are looked for."""
_NEAREST = 12
"""Corners about a missing one that tell where it is."""
_MAX_BEND = 0.3
"""Change of step along a row or column, in steps, above which a corner is not of the board; where a
lens bends the line, change of that change."""


@dataclass(frozen=True, slots=True)
class Corners:
    """The inner corners of one board in one picture."""

    board: Checkerboard
    xy_px: Float
    """(rows, columns, 2), px; corner (0, 0) touches the black corner square of the board."""
    sigma_px: Float
    """(rows, columns), 1 sigma per coordinate."""
    blur_px: float
    """Median sigma of the edges, pixel area included."""
    contrast: float
    """Median difference of white and black, grey levels of the picture."""

    @property
    def side_px(self) -> float:
        """Median side of a square, px."""
        return Lattice(self.xy_px, self.xy_px).side_px


def find_corners(image: Image, board: Checkerboard) -> Corners:
    """Find all inner corners of a board to sub-pixel precision.

    The order is the same in every view: rows and columns run right-handed as on
    `Checkerboard.points_mm`, and the square outside corner (0, 0) is black. Where the colours leave
    a choice (rows and columns both even or both odd), corner (0, 0) is the one nearest the top left
    of the image; a board turned past that point changes its order.

    Args:
        image: (H, W) grey; float32 in 8-bit grey levels.
        board: The board to look for; all of it must be visible.

    Raises:
        TargetError: the board is not there as asked for; `reason` is one of wrong-count, blurred,
            too-small, clipped, over-exposed, under-exposed, not-found.
    """
    if image.ndim != 2 or min(image.shape) < 16 or not np.isfinite(image).all():
        raise TargetError(
            f"{board} board asked for in an array of shape {image.shape}",
            advice="give a grey picture (H, W) of at least 16 x 16 finite pixels",
            reason="not-found",
        )
    pictures = pyramid(image, _LEVELS)
    seen: list[Lattice] = []
    for level in search_order(pictures):
        for lattice in _lattices(pictures[level]):
            corners = _fit(pictures, level, lattice, board)
            if corners is not None:
                return _checked(corners)
            seen.append(Lattice(from_level(lattice.xy_px, level), lattice.bright))
    raise why_not(image, board, seen)


def corner_motion_px(first: Corners, last: Corners) -> float:
    """Root mean square distance that the corners moved between two pictures of one view, px.

    Raises:
        TargetError: the two pictures are of different boards.
    """
    if first.xy_px.shape != last.xy_px.shape:
        raise TargetError(
            f"motion asked for between boards of {first.board} and {last.board} inner corners",
            advice="compare pictures of one board",
            reason="wrong-count",
        )
    moved = np.linalg.norm(last.xy_px - first.xy_px, axis=-1)
    return float(np.sqrt(np.mean(moved**2)))


def _lattices(picture: NDArray[np.float32]) -> list[Lattice]:
    saddles = find_saddles(picture, smooth_px=_SMOOTH_PX, ring_px=_RING_PX)
    return grow_lattices(saddles)[:3]


def _fit(
    pictures: list[NDArray[np.float32]], level: int, lattice: Lattice, board: Checkerboard
) -> Corners | None:
    """Corners in the picture that suits their blur; None if it is not that board."""
    turned = _oriented(lattice, board)
    if turned is None or turned.found.mean() < _MIN_FOUND:
        return None
    xy_px = from_level(_completed(turned.xy_px), level)
    tried: set[int] = set()
    while True:
        scale = 2**level
        fit = _crossings(pictures[level], at_level(xy_px, level))
        if not _is_board(fit, board):
            return None
        xy_px = from_level(fit.xy_px.reshape(xy_px.shape), level)
        blur_px = float(np.median(fit.blur_px))
        tried.add(level)
        level = _suiting(blur_px, level, len(pictures))
        if level in tried:
            break
    return Corners(
        board,
        xy_px,
        fit.sigma_px.reshape(xy_px.shape[:2]) * scale,
        blur_px * scale,
        float(np.median(np.abs(fit.contrast))),
    )


def _suiting(blur_px: float, level: int, levels: int) -> int:
    """The next finer or coarser picture where edges are too sharp or too blurred for this one."""
    if blur_px < _SHARP_PX:
        return max(level - 1, 0)
    return min(level + 1, levels - 1) if blur_px > _BLURRED_PX else level


def _oriented(lattice: Lattice, board: Checkerboard) -> Lattice | None:
    """Turned to the board's order; None if the counts differ."""
    choices: list[tuple[float, Lattice]] = []
    for turned in _turns(lattice):
        turned = cut_to_size(turned, (board.rows, board.columns), _MIN_FOUND)
        if turned is not None and _black_first(turned):
            choices.append((float(np.nan_to_num(turned.xy_px[0, 0]).sum()), turned))
    return min(choices, key=lambda choice: choice[0])[1] if choices else None


def _turns(lattice: Lattice) -> Iterator[Lattice]:
    for quarter in range(4):
        yield Lattice(np.rot90(lattice.xy_px, quarter), np.rot90(lattice.bright, quarter))


def _black_first(lattice: Lattice) -> bool:
    """Whether the square outside corner (0, 0) is black, by vote of all corners."""
    down = np.nanmean(np.diff(lattice.xy_px, axis=0), axis=(0, 1))
    right = np.nanmean(np.diff(lattice.xy_px, axis=1), axis=(0, 1))
    angle = 2 * np.arctan2(*(down / np.hypot(*down) + right / np.hypot(*right))[::-1])
    towards = lattice.bright @ np.array([np.cos(angle), np.sin(angle)])
    row, column = np.indices(towards.shape)
    return float(np.nansum(np.where((row + column) % 2 == 0, towards, -towards))) < 0


def _completed(xy_px: Float) -> Float:
    """Missing corners where a homography through the nearest others puts them.

    Through all of them a wide lens would put it far off.
    """
    found = np.isfinite(xy_px[..., 0])
    places = grid_places(*found.shape)
    whole = xy_px.copy()
    for place in np.argwhere(~found):
        apart = np.linalg.norm(places[found] - places[tuple(place)], axis=1)
        near = np.argsort(apart, kind="stable")[:_NEAREST]
        homography = fit_homography(places[found][near], xy_px[found][near])
        whole[tuple(place)] = map_points(homography, places[tuple(place)][None])[0]
    return whole


def _crossings(picture: NDArray[np.float32], start: Float) -> CrossingFit:
    down, right = np.gradient(start, axis=0), np.gradient(start, axis=1)
    area = np.abs(down[..., 0] * right[..., 1] - down[..., 1] * right[..., 0])
    longest = np.maximum(np.linalg.norm(down, axis=-1), np.linalg.norm(right, axis=-1))
    axes = np.stack([right, down], axis=-2)
    axes = axes / np.linalg.norm(axes, axis=-1, keepdims=True)
    clear_px = area / longest
    return fit_crossings(picture, start.reshape(-1, 2), axes.reshape(-1, 2, 2), clear_px.ravel())


def _is_board(fit: CrossingFit, board: Checkerboard) -> bool:
    """All corners there, colours in turn, rows and columns smooth."""
    if not np.isfinite(fit.xy_px).all():
        return False
    row, column = np.indices((board.rows, board.columns))
    signed = fit.contrast.reshape(row.shape) * np.where((row + column) % 2, -1, 1)
    xy_px = fit.xy_px.reshape(*row.shape, 2)
    lines = (xy_px, xy_px.transpose(1, 0, 2))
    is_smooth = all(smooth_triples(points, _MAX_BEND).all() for points in lines)
    return bool((signed > 0).all() or (signed < 0).all()) and is_smooth


def _checked(corners: Corners) -> Corners:
    """Refuse a board that is there but too small or too blurred to measure."""
    side_px, board = corners.side_px, corners.board
    if side_px < MIN_SIDE_PX:
        raise TargetError(
            f"{board} board found with squares of {side_px:.1f} px, at least {MIN_SIDE_PX:.0f} px "
            "are needed",
            advice="bring the board nearer or use larger squares",
            reason="too-small",
        )
    if corners.blur_px > MAX_BLUR_RATIO * side_px:
        raise TargetError(
            f"{board} board found with edges blurred by {corners.blur_px:.1f} px on squares of "
            f"{side_px:.1f} px, at most {MAX_BLUR_RATIO * side_px:.1f} px can be measured",
            advice="focus the lens, or hold the board still",
            reason="blurred",
        )
    return corners
