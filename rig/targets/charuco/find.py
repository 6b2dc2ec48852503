"""Find the corners of a ChArUco board, or of the part of it that is in view.

The corners come first: saddle points joined by edges into lattices, as for a checkerboard. The
markers only say which corner is which, so one readable marker names a whole lattice. From there
the rest of the board is looked for corner by corner. The work is bounded by structure: a few
resolutions, at most `MAX_SADDLES` points in each, three lattices, as many squares as they have.
"""

import cv2
import numpy as np

from rig.arrays import Float
from rig.targets.candidates import candidates
from rig.targets.charuco.board import CharucoBoard
from rig.targets.charuco.diagnosis import why_not
from rig.targets.charuco.grid_fit import CornerGrid, fit_grid, has_square
from rig.targets.charuco.markers import Placing, place_lattice
from rig.targets.detection import Detection
from rig.targets.lattice import Lattice, grow_lattices
from rig.targets.measurable import check_measurable
from rig.targets.pyramid import Image, Picture, pyramid
from rig.targets.saddles import Saddles

FEWEST_CORNERS = 6
"""Fewer do not fix the pose of the board with anything to spare."""

_LEVELS = 5
_RING_PX = 2.6
"""Half diagonal of a margin in squares of 15 px: the ring must not reach the markers."""
_LATTICES = 3
_FEWEST_IN_LATTICE = 4
_SHARP_PX, _BLURRED_PX = 1.0, 2.5
"""Blur of the picture in which corners are measured best, where there is a finer or coarser one."""


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
    for level, lattice in candidates(pictures, _RING_PX, _grown):
        seen.append(lattice)
        placing = place_lattice(pictures[0], lattice.xy_px, board)
        if placing is None:
            continue
        detection = _measured(pictures, level, _on_board(lattice, placing, board), board)
        if detection is not None and len(detection) >= FEWEST_CORNERS:
            return detection
        most = max(most, 0 if detection is None else len(detection))
    raise why_not(image, pictures, board, seen, most)


def _black_on_white(image: Image, board: CharucoBoard) -> Picture:
    picture = np.asarray(image, np.float32)
    if not board.inverted:
        return picture
    return np.float32(65535 if image.dtype == np.uint16 else 255) - picture


def _grown(saddles: Saddles, picture: Picture) -> list[Lattice]:
    lattices = grow_lattices(saddles, edges_of=picture, fewest=_FEWEST_IN_LATTICE)
    return [lattice for lattice in lattices if has_square(lattice.found)][:_LATTICES]


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
    grid: CornerGrid | None = None
    # A coarse picture finds corners sooner than it measures them: margins are narrow in it.
    level = max(level - 1, 0)
    while grid is None and level >= 0:
        grid = fit_grid(pictures[level], level, xy_px, seen, board)
        level -= 1
    level += 1
    tried = {level}
    while grid is not None:
        following = _suiting(grid.blur_px / 2**level, level, len(pictures))
        if following in tried:
            break
        tried.add(following)
        other = fit_grid(pictures[following], following, grid.xy_px, grid.found, board)
        if other is None:
            break
        level, grid = following, other
    if grid is None:
        return None
    for _ in range(board.rows + board.columns):
        ring = cv2.dilate(grid.found.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        if np.array_equal(ring, grid.found):
            break
        wider = fit_grid(pictures[level], level, grid.xy_px, ring, board, grid.fits)
        if wider is None or int(wider.found.sum()) <= int(grid.found.sum()):
            break
        grid = wider
    return _detection(grid, board)


def _suiting(blur_px: float, level: int, levels: int) -> int:
    """The next finer or coarser picture where edges are too sharp or too blurred for this one."""
    if blur_px < _SHARP_PX:
        return max(level - 1, 0)
    return min(level + 1, levels - 1) if blur_px > _BLURRED_PX else level


def _detection(grid: CornerGrid, board: CharucoBoard) -> Detection | None:
    if not has_square(grid.found):
        return None
    row, column = np.nonzero(grid.found)
    side_px = Lattice(grid.xy_px, grid.xy_px).side_px
    check_measurable(f"ChArUco board of {board} squares", side_px, grid.blur_px)
    return Detection(
        row * board.columns + column,
        grid.xy_px[row, column],
        grid.sigma_px[row, column],
        grid.blur_px,
        grid.contrast,
    )
