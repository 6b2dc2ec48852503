"""Find the corners of a ChArUco board, or of the part of it that is in view.

The corners come first: saddle points joined by edges into lattices, as for a checkerboard. The
markers only say which corner is which, so one readable marker names a whole lattice. From there
the rest of the board is looked for corner by corner. The work is bounded by structure: a few
resolutions, at most `MAX_SADDLES` points in each, three lattices, as many squares as they have.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.geometry.corner_fit import CrossingFit, fit_crossings
from rig.geometry.lattice import Lattice, grow_lattices
from rig.geometry.pyramid import Image, Picture, at_level, from_level, pyramid, search_order
from rig.geometry.saddles import find_saddles
from rig.geometry.targets.charuco_board import CharucoBoard
from rig.geometry.targets.charuco_diagnosis import check_measurable, why_not
from rig.geometry.targets.detection import Detection
from rig.geometry.targets.markers import Placing, padded_grid, place_lattice
from rig.geometry.targets.outliers import inliers

Float = NDArray[np.float64]

FEWEST_CORNERS = 6
"""Fewer do not fix the pose of the board with anything to spare."""

_LEVELS = 5
_SMOOTH_PX = 1.0
_RING_PX = 2.6
"""Half diagonal of a margin in squares of 15 px: the ring must not reach the markers."""
_LATTICES = 3
_FEWEST_IN_LATTICE = 4
_SHARP_PX, _BLURRED_PX = 1.0, 2.5
"""Blur of the picture in which corners are measured best, where there is a finer or coarser one."""
_CLEAR_SHARE = 2.0
"""Marker corners point at a corner from both sides alike and do not pull it; what differs from
side to side begins at this many widths of the margin."""
_LEAST_CONTRAST = 0.35
"""Of the median: a crossing fitted with less is not of the board."""
_MOST_MOVED = 0.1
"""Way from where a corner is expected to where it is fitted, in sides of a square."""
_MOST_SIGMAS = 6.0
"""Sigma of a corner, in medians: fitted to something else."""


@dataclass(frozen=True, slots=True)
class _Grid:
    """Corners on the board's grid, NaN where there is none."""

    xy_px: Float
    """(rows, columns, 2)."""
    sigma_px: Float
    """(rows, columns)."""
    blur_px: float
    contrast: float

    @property
    def found(self) -> NDArray[np.bool_]:
        """(rows, columns) whether there is a corner."""
        return np.isfinite(self.xy_px[..., 0])


def find_charuco(image: Image, board: CharucoBoard) -> Detection:
    """Find the visible inner corners of a ChArUco board to sub-pixel precision.

    Args:
        image: (H, W) grey, finite; float32 in 8-bit grey levels.
        board: The board to look for.

    Raises:
        TargetError: not found as asked for; `reason` is one of wrong-dictionary, wrong-pattern,
            wrong-count, few-corners, too-small, blurred, over-exposed, under-exposed, not-found.
    """
    pictures = pyramid(_black_on_white(image, board), _LEVELS)
    seen: list[Lattice] = []
    most = 0
    for level in search_order(pictures):
        for lattice in _lattices(pictures[level]):
            lattice = Lattice(from_level(lattice.xy_px, level), lattice.bright)
            seen.append(lattice)
            placing = place_lattice(pictures[0], lattice.xy_px, board)
            if placing is None:
                continue
            detection = _measured(pictures, level, _on_board(lattice, placing, board), board)
            if detection is not None and len(detection) >= FEWEST_CORNERS:
                return detection
            most = max(most, 0 if detection is None else len(detection))
    raise why_not(image, pictures[0], board, seen, most)


def _black_on_white(image: Image, board: CharucoBoard) -> Picture:
    picture = np.asarray(image, np.float32)
    if not board.inverted:
        return picture
    return np.float32(65535 if image.dtype == np.uint16 else 255) - picture


def _lattices(picture: Picture) -> list[Lattice]:
    saddles = find_saddles(picture, smooth_px=_SMOOTH_PX, ring_px=_RING_PX)
    lattices = grow_lattices(saddles, edges_of=picture, fewest=_FEWEST_IN_LATTICE)
    return [lattice for lattice in lattices if _has_square(lattice.found)][:_LATTICES]


def _on_board(lattice: Lattice, placing: Placing, board: CharucoBoard) -> Float:
    """(rows, columns, 2) corners of the lattice where the board has them, NaN elsewhere."""
    turned = np.rot90(lattice.xy_px, placing.quarters)
    grid = np.full((board.rows, board.columns, 2), np.nan)
    row = np.indices(turned.shape[:2])[0] + placing.row
    column = np.indices(turned.shape[:2])[1] + placing.column
    there = (row >= 0) & (row < board.rows) & (column >= 0) & (column < board.columns)
    grid[row[there], column[there]] = turned[there]
    return grid


def _measured(
    pictures: list[Picture], level: int, xy_px: Float, board: CharucoBoard
) -> Detection | None:
    """Fit the corners in the picture that suits their blur, then those around them.

    Raises:
        TargetError: the corners are there but cannot be measured.
    """
    seen = np.isfinite(xy_px[..., 0])
    grid: _Grid | None = None
    # A coarse picture finds corners sooner than it measures them: margins are narrow in it.
    level = max(level - 1, 0)
    while grid is None and level >= 0:
        grid = _fitted(pictures, level, xy_px, seen, board)
        level -= 1
    level += 1
    tried = {level}
    while grid is not None:
        following = _suiting(grid.blur_px / 2**level, level, len(pictures))
        if following in tried:
            break
        tried.add(following)
        other = _fitted(pictures, following, grid.xy_px, grid.found, board)
        if other is None:
            break
        level, grid = following, other
    if grid is None:
        return None
    for _ in range(board.rows + board.columns):
        ring = cv2.dilate(grid.found.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        if np.array_equal(ring, grid.found):
            break
        wider = _fitted(pictures, level, grid.xy_px, ring, board)
        if wider is None or int(wider.found.sum()) <= int(grid.found.sum()):
            break
        grid = wider
    return _detection(grid, board)


def _suiting(blur_px: float, level: int, levels: int) -> int:
    """The next finer or coarser picture where edges are too sharp or too blurred for this one."""
    if blur_px < _SHARP_PX:
        return max(level - 1, 0)
    return min(level + 1, levels - 1) if blur_px > _BLURRED_PX else level


def _fitted(
    pictures: list[Picture],
    level: int,
    xy_px: Float,
    wanted: NDArray[np.bool_],
    board: CharucoBoard,
) -> _Grid | None:
    """Corners (rows, columns, 2) fitted at one level; None where too few are left to go on."""
    if not _has_square(np.isfinite(xy_px[..., 0])):
        return None
    around = padded_grid(at_level(xy_px, level))
    down, right = np.gradient(around, axis=0), np.gradient(around, axis=1)
    start, down, right = (place[1:-1, 1:-1][wanted] for place in (around, down, right))
    area = np.abs(down[:, 0] * right[:, 1] - down[:, 1] * right[:, 0])
    longest = np.maximum(np.linalg.norm(down, axis=1), np.linalg.norm(right, axis=1))
    side_px = area / np.maximum(longest, 1e-9)
    axes = np.stack([right, down], axis=1)
    axes /= np.maximum(np.linalg.norm(axes, axis=-1, keepdims=True), 1e-9)
    margin = (1 - board.marker_mm / board.square_mm) / 2
    fit = fit_crossings(pictures[level], start, axes, _CLEAR_SHARE * margin * side_px)
    row, column = np.nonzero(wanted)
    good = _good(fit, start, side_px, (row + column) % 2 == 0)
    if not good.any():
        return None
    fitted = np.full(xy_px.shape, np.nan)
    sigma_px = np.full(xy_px.shape[:2], np.nan)
    fitted[row[good], column[good]] = from_level(fit.xy_px[good], level)
    sigma_px[row[good], column[good]] = fit.sigma_px[good] * 2**level
    kept = inliers(fitted, sigma_px)
    fitted[~kept], sigma_px[~kept] = np.nan, np.nan
    return _Grid(
        fitted,
        sigma_px,
        float(np.median(fit.blur_px[good])) * 2**level,
        float(np.median(np.abs(fit.contrast[good]))),
    )


def _good(
    fit: CrossingFit, start: Float, side_px: Float, even: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which fits are corners of the board: in place, as strong and sharp, colours in turn."""
    # No residual at all: a flat piece of a picture, which any crossing without contrast fits.
    usable = np.isfinite(fit.sigma_px) & (fit.sigma_px > 0)
    if not usable.any():
        return usable
    signed = np.where(even, fit.contrast, -fit.contrast)
    usual = float(np.median(signed[usable]))
    usable &= signed * np.sign(usual) > _LEAST_CONTRAST * abs(usual)
    usable &= np.linalg.norm(fit.xy_px - start, axis=1) < _MOST_MOVED * side_px
    if usable.any():
        usable &= fit.sigma_px < _MOST_SIGMAS * np.median(fit.sigma_px[usable])
    return usable


def _has_square(found: NDArray[np.bool_]) -> bool:
    """Whether all corners of some square are there: without, a homography is not fixed."""
    return bool((found[:-1, :-1] & found[:-1, 1:] & found[1:, :-1] & found[1:, 1:]).any())


def _detection(grid: _Grid, board: CharucoBoard) -> Detection | None:
    if not _has_square(grid.found):
        return None
    row, column = np.nonzero(grid.found)
    side_px = Lattice(grid.xy_px, grid.xy_px).side_px
    check_measurable(board, side_px, grid.blur_px)
    return Detection(
        row * board.columns + column,
        grid.xy_px[row, column],
        grid.sigma_px[row, column],
        grid.blur_px,
        grid.contrast,
    )
