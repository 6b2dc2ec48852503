"""Why a board was not found, from what was found instead."""

import numpy as np
from numpy.typing import NDArray

from rig.errors import TargetError
from rig.geometry.board import Board
from rig.geometry.lattice import Lattice

Image = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

MIN_SIDE_PX = 6.0
"""Smaller squares leave no room between one edge and the next."""
MAX_BLUR_RATIO = 0.2
"""Sigma of an edge over the side of a square, above which neighbouring edges run together."""

_FEWEST = 6
"""A lattice of fewer corners than this is chance."""
_DARK = 0.12
"""Brightest pixels below this share of full scale: too dark."""
_BURNT = 0.2
"""Share of saturated pixels above which exposure is to blame."""


def why_not(image: Image, board: Board, seen: list[Lattice]) -> TargetError:
    """Return the error that says what was asked, what was found and what to do.

    Args:
        image: (H, W) grey.
        board: What was asked for.
        seen: Lattices found at any resolution, in px of the image.
    """
    best = max(seen, key=lambda lattice: int(lattice.found.sum()), default=None)
    if best is None or int(best.found.sum()) < _FEWEST:
        return _exposure(image, board) or TargetError(
            f"{board} board asked for, nothing like a checkerboard found; "
            "put the board in view and light it",
            reason="not-found",
        )
    if best.side_px < MIN_SIDE_PX:
        return TargetError(
            f"{board} board asked for, found {_count(best)} corners on squares of "
            f"{best.side_px:.1f} px, at least {MIN_SIDE_PX:.0f} px are needed; "
            "bring the board nearer or use larger squares",
            reason="too-small",
        )
    borders = _touched(best, image.shape)
    if borders and not _larger(best, board):
        return TargetError(
            f"{board} board asked for, found {_count(best)} corners up to the "
            f"{' and '.join(borders)} border of the picture; move the board until all of it is "
            "in view",
            reason="clipped",
        )
    if best.found.all():
        return TargetError(
            f"{board} board asked for, found one of {_count(best)} inner corners; "
            f"set columns and rows to {_count(best)}, or use the other board",
            reason="wrong-count",
        )
    return _exposure(image, board) or TargetError(
        f"{board} board asked for, found {int(best.found.sum())} corners on a lattice of "
        f"{_count(best)}; uncover the board and avoid glare",
        reason="not-found",
    )


def _count(lattice: Lattice) -> str:
    return f"{max(lattice.shape)} x {min(lattice.shape)}"


def _larger(lattice: Lattice, board: Board) -> bool:
    return min(lattice.shape) > min(board.rows, board.columns) or max(lattice.shape) > max(
        board.rows, board.columns
    )


def _touched(lattice: Lattice, shape: tuple[int, ...]) -> list[str]:
    """Borders beyond which the next row or column of corners would lie."""
    xy_px = lattice.xy_px
    beyond = np.concatenate(
        [
            (2 * near - far).reshape(-1, 2)
            for near, far in (
                (xy_px[0], xy_px[1]),
                (xy_px[-1], xy_px[-2]),
                (xy_px[:, 0], xy_px[:, 1]),
                (xy_px[:, -1], xy_px[:, -2]),
            )
        ]
    )
    x, y = beyond[np.isfinite(beyond[:, 0])].T
    edge = 4.0
    outside = {
        "left": x < edge,
        "right": x > shape[1] - 1 - edge,
        "top": y < edge,
        "bottom": y > shape[0] - 1 - edge,
    }
    return [name for name, out in outside.items() if out.any()]


def _exposure(image: Image, board: Board) -> TargetError | None:
    """Too dark or too bright a picture, if that is what it is."""
    full = _full_scale(image)
    burnt = float((image >= full).mean())
    if burnt > _BURNT:
        return TargetError(
            f"{board} board asked for, not found with {burnt:.0%} of the pixels saturated at "
            f"{full:.0f}; shorten the exposure or dim the light",
            reason="over-exposed",
        )
    brightest = float(np.percentile(image, 99.5))
    if brightest < _DARK * full:
        return TargetError(
            f"{board} board asked for, not found in a dark picture: brightest pixels at "
            f"{brightest:.0f} of {full:.0f}; lengthen the exposure or add light",
            reason="under-exposed",
        )
    return None


def _full_scale(image: Image) -> float:
    """Largest grey level; 16-bit pictures may hold 10, 12, 14 or 16 bits."""
    if image.dtype != np.uint16:
        return 255.0
    return next(2.0**bits - 1 for bits in (10, 12, 14, 16) if int(image.max()) < 2**bits)
