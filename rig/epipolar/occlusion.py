"""Which points some of the views cannot see, told by the slopes themselves.

Each pixel is moved into a view; where a nearer point (larger slope) lands on the same place, it
hides the farther one: a depth buffer, as in E. Catmull, "A subdivision algorithm for computer
display of curved surfaces" (1974).
"""

import cv2
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
    sides = (np.flatnonzero(half == h) for h in range(HALVES))
    ends = np.array([views[np.argmax(reach[views])] for views in sides if len(views)])
    hidden = hidden_in_views(slope_px, x_steps[ends], y_steps[ends], jump_px, 0)
    return np.logical_or.reduce(hidden, axis=0)


def hidden_in_views(
    slope_px: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    jump_px: float,
    margin_px: int,
) -> NDArray[np.bool_]:
    """Which pixels each view does not show, (V, H, W).

    Args:
        slope_px: (H, W).
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        jump_px: a point counts as nearer when its slope is larger by this, px per view step.
        margin_px: how far a nearer point spoils what is beside it, by blur and interpolation.
    """
    hidden = np.zeros((len(x_steps), *slope_px.shape), np.bool_)
    away = np.flatnonzero(np.hypot(x_steps, y_steps) > 0)

    def work(start: int, stop: int) -> None:
        place = np.empty(slope_px.shape, np.int32)
        buffer = np.empty(slope_px.size + 1, np.float32)
        nearest = buffer[:-1].reshape(slope_px.shape)
        for i in away[start:stop]:
            _move(slope_px, np.float32(x_steps[i]), np.float32(y_steps[i]), place)
            buffer[:] = -np.inf
            _draw(slope_px.ravel(), place.ravel(), buffer)
            buffer[-1] = -np.inf  # nothing outside the view hides anything
            if margin_px > 0:
                across = 1 if y_steps[i] == 0 else 2 * margin_px + 1
                along = 1 if x_steps[i] == 0 else 2 * margin_px + 1
                nearest[:] = cv2.dilate(nearest, np.ones((across, along), np.uint8))
            _look(slope_px.ravel(), place.ravel(), np.float32(jump_px), buffer, hidden[i].ravel())

    run_in_bands(work, len(away))
    return hidden


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
def _draw(
    slope: NDArray[np.float32], place: NDArray[np.int32], nearest: NDArray[np.float32]
) -> None:
    """Keep the nearest slope at every place of the view."""
    for u in range(len(place)):
        k = np.uintp(np.uint32(place[u]))
        nearest[k] = max(nearest[k], slope[u])


@kernel()
def _look(
    slope: NDArray[np.float32],
    place: NDArray[np.int32],
    jump: np.float32,
    nearest: NDArray[np.float32],
    hidden: NDArray[np.bool_],
) -> None:
    """Mark who lies behind the nearest slope at its place."""
    for u in range(len(place)):
        k = np.uintp(np.uint32(place[u]))
        hidden[u] = nearest[k] > slope[u] + jump
