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
        place = np.empty(slope_px.shape, np.int32)
        nearest = np.empty(slope_px.size + 1, np.float32)
        for h in range(start, stop):
            members = np.flatnonzero(half == h)
            if len(members):
                i = members[np.argmax(reach[members])]
                step = np.float32(x_steps[i]), np.float32(y_steps[i])
                _move(slope_px, *step, place)
                nearest[:] = -np.inf
                _hide(
                    slope_px.ravel(), place.ravel(), np.float32(jump_px), nearest, hidden[h].ravel()
                )

    run_in_bands(work, HALVES)
    return np.logical_or.reduce(hidden, axis=0)


@kernel()
def _move(
    slope: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    place: NDArray[np.int32],
) -> None:
    """Index of the pixel of the view where each point lands; one past the last if outside."""
    height, width = slope.shape
    half = np.float32(0.5)
    right, bottom = np.float32(width), np.float32(height)
    stride = np.int32(width)
    outside = np.int32(height * width)
    for v in range(height):
        row, target = slope[v], place[v]
        for u in range(width):
            x = np.float32(u) - row[u] * x_step + half
            y = np.float32(v) - row[u] * y_step + half
            inside = (x >= 0) & (y >= 0) & (x < right) & (y < bottom)
            x = x if inside else half
            y = y if inside else half
            here = np.int32(np.int32(np.int32(y) * stride) + np.int32(x))
            target[u] = here if inside else outside


@kernel()
def _hide(
    slope: NDArray[np.float32],
    place: NDArray[np.int32],
    jump: np.float32,
    nearest: NDArray[np.float32],
    hidden: NDArray[np.bool_],
) -> None:
    """First find the nearest slope at every place of the view, then who lies behind it."""
    outside = np.uintp(len(place))
    for u in range(len(place)):
        k = np.uintp(np.uint32(place[u]))
        nearest[k] = max(nearest[k], slope[u])
    nearest[outside] = np.float32(-np.inf)
    for u in range(len(place)):
        k = np.uintp(np.uint32(place[u]))
        hidden[u] = nearest[k] > slope[u] + jump
