"""Which points some of the views cannot see, told by the slopes themselves.

Each pixel is moved into a view; where a nearer point (larger slope) lands on the same place, it
hides the farther one: a depth buffer, as in E. Catmull, "A subdivision algorithm for computer
display of curved surfaces" (1974).
"""

import numpy as np
from numpy.typing import NDArray

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
    hidden = np.zeros(slope_px.shape, np.bool_)
    nearest = np.empty(slope_px.shape, np.float32)
    for h in range(HALVES):
        members = np.flatnonzero(half == h)
        if len(members):
            i = members[np.argmax(reach[members])]
            _hide(
                slope_px, np.float32(x_steps[i]), np.float32(y_steps[i]), np.float32(jump_px),
                nearest, hidden,
            )  # fmt: skip
    return hidden


@kernel()
def _hide(
    slope: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    jump: np.float32,
    nearest: NDArray[np.float32],
    hidden: NDArray[np.bool_],
) -> None:
    height, width = slope.shape
    nearest[:] = np.float32(-1e30)
    half = np.float32(0.5)
    for v in range(height):
        for u in range(width):
            m = slope[v, u]
            x, y = int(np.floor(u - m * x_step + half)), int(np.floor(v - m * y_step + half))
            if 0 <= x < width and 0 <= y < height and nearest[y, x] < m:
                nearest[y, x] = m
    for v in range(height):
        for u in range(width):
            m = slope[v, u]
            x, y = int(np.floor(u - m * x_step + half)), int(np.floor(v - m * y_step + half))
            if 0 <= x < width and 0 <= y < height and nearest[y, x] > m + jump:
                hidden[v, u] = True
