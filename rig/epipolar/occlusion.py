"""Which points some of the views cannot see, told by the slopes themselves.

Each pixel is moved into a view; where a nearer point (larger slope) lands on the same place, it
hides the farther one: a depth buffer, as in E. Catmull, "A subdivision algorithm for computer
display of curved surfaces" (1974).
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.halves import HALVES, assign_halves
from rig.epipolar.kernel import kernel


def hidden_somewhere(
    slope_px: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    jump_px: float,
) -> NDArray[np.bool_]:
    """Pixels hidden in the outermost view of at least one half, (H, W).

    Args:
        slope_px: (H, W).
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        jump_px: a point counts as nearer when its slope is larger by this, px per view step.
    """
    half = assign_halves(x_steps, y_steps)
    reach = np.hypot(x_steps, y_steps)
    hidden = np.zeros((HALVES, *slope_px.shape), np.bool_)

    def work(start: int, stop: int) -> None:
        nearest = np.empty(slope_px.shape, np.float32)
        for h in range(start, stop):
            members = np.flatnonzero(half == h)
            if len(members):
                i = members[np.argmax(reach[members])]
                step = np.float32(x_steps[i]), np.float32(y_steps[i])
                _hide(slope_px, *step, np.float32(jump_px), nearest, hidden[h])

    run_in_bands(work, HALVES)
    return np.logical_or.reduce(hidden, axis=0)


@kernel()
def _hide(
    slope: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    jump: np.float32,
    nearest: NDArray[np.float32],
    hidden: NDArray[np.bool_],
) -> None:
    """First find the nearest slope at every place of the view, then who lies behind it."""
    height, width = slope.shape
    half = np.float32(0.5)
    for v in range(height):
        for u in range(width):
            nearest[v, u] = np.float32(-1e30)
    for judging in range(2):
        for v in range(height):
            for u in range(width):
                m = slope[v, u]
                x = np.float32(u) - m * x_step + half
                y = np.float32(v) - m * y_step + half
                if x >= 0 and y >= 0 and x < width and y < height:
                    column, row = np.uintp(np.int32(x)), np.uintp(np.int32(y))
                    if judging == 1:
                        hidden[v, u] = nearest[row, column] > m + jump
                    else:
                        nearest[row, column] = max(nearest[row, column], m)
