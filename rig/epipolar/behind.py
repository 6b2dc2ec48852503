"""What the blur of a nearer surface spoils of the one behind it."""

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel

_BEHIND_SHARE = np.float32(0.02)


def behind_jumps(
    slope_px: NDArray[np.float32], information: NDArray[np.float32], jump_px: float
) -> NDArray[np.float32]:
    """Take away most of the information of pixels that touch a nearer surface.

    The grey edge of the nearer surface moves with that surface, but its blur reaches into the
    first pixel of the farther one and would tell that pixel the wrong slope with much confidence.

    Args:
        slope_px: (H, W).
        information: (H, W), or a thin map (`rig.epipolar.chessboard`): precision of each line.
        jump_px: difference of slope from which another surface is nearer, px per view step.
    """
    left = np.empty_like(information)

    def work(start: int, stop: int) -> None:
        _hold_back(slope_px, information, np.float32(jump_px), start, stop, left)

    run_in_bands(work, len(left))
    return left


@kernel()
def _hold_back(
    slope_px: NDArray[np.float32],
    information: NDArray[np.float32],
    jump: np.float32,
    start: int,
    stop: int,
    left: NDArray[np.float32],
) -> None:
    """Compare each pixel with the largest of nine slopes: down the columns first, then along."""
    height, width = slope_px.shape
    is_thin = information.shape[1] != width
    framed, behind = np.full(width + 2, -np.inf, np.float32), np.empty(width, np.float32)
    before, middle, after = framed[:width], framed[1 : width + 1], framed[2:]
    for v in range(start, stop):
        above, here, below = slope_px[max(v - 1, 0)], slope_px[v], slope_px[min(v + 1, height - 1)]
        for u in range(width):
            middle[u] = max(above[u], here[u], below[u])
        for u in range(width):
            nearest = max(before[u], middle[u], after[u])
            behind[u] = _BEHIND_SHARE if nearest > here[u] + jump else np.float32(1)
        own, out = information[v], left[v]
        if is_thin:
            odd = v % 2
            for k in range(len(out)):
                out[k] = own[k] * behind[min(2 * k + odd, width - 1)]
        else:
            for u in range(width):
                out[u] = own[u] * behind[u]
