"""Which points some of the views cannot see, told by the slopes themselves.

Each pixel is moved into a view; where a nearer point (larger slope) lands on the same place, it
hides the farther one: a depth buffer, as in E. Catmull, "A subdivision algorithm for computer
display of curved surfaces" (1974).
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.chessboard import thinned
from rig.epipolar.search.halves import HALVES, assign_halves


def hidden_points(
    slope_px: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    jump_px: float,
    margin_px: int,
    *,
    is_thin: bool = False,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell what each view does not show, and what is hidden at the rim of the array.

    Args:
        slope_px: (H, W).
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        jump_px: a point counts as nearer when its slope is larger by this, px per view step.
        margin_px: how far a nearer point spoils what is beside it, by blur and interpolation.
        is_thin: whether every second pixel will do.

    Returns:
        Pixels that each view does not show, or not clean within the margin, (V, H, W); and those
        hidden in the outermost view of at least one half, without any margin, (H, W). All of them,
        or thin maps (`rig.epipolar.chessboard`).
    """
    height, width = slope_px.shape
    asked = thinned(slope_px) if is_thin else slope_px
    covered = np.zeros((len(x_steps), *asked.shape), np.bool_)
    away = np.flatnonzero(np.hypot(x_steps, y_steps) > 0)
    ends = _outermost(x_steps, y_steps)
    hidden = np.zeros((len(ends), *asked.shape), np.bool_)

    def work(start: int, stop: int) -> None:
        for i in away[start:stop]:
            step = np.float32(x_steps[i]), np.float32(y_steps[i])
            nearest = np.full(height * width + 1, -np.inf, np.float32)
            _draw(slope_px, *step, nearest)
            nearest[-1] = -np.inf  # nothing outside the view hides anything
            if i in ends:
                _look(asked, width, *step, np.float32(jump_px), nearest, hidden[ends.index(i)])
            if margin_px > 0:
                across = 1 if y_steps[i] == 0 else 2 * margin_px + 1
                along = 1 if x_steps[i] == 0 else 2 * margin_px + 1
                picture = nearest[:-1].reshape(height, width)
                cv2.dilate(picture, np.ones((across, along), np.uint8), dst=picture)
            _look(asked, width, *step, np.float32(jump_px), nearest, covered[i])

    run_in_bands(work, len(away))
    return covered, np.logical_or.reduce(hidden, axis=0)


def _outermost(x_steps: NDArray[np.float64], y_steps: NDArray[np.float64]) -> list[int]:
    """Index of the outermost view of each half that has views."""
    half, reach = assign_halves(x_steps, y_steps), np.hypot(x_steps, y_steps)
    sides = (np.flatnonzero(half == h) for h in range(HALVES))
    return [int(views[np.argmax(reach[views])]) for views in sides if len(views)]


@kernel()
def _draw(
    slope: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    nearest: NDArray[np.float32],
) -> None:
    """Keep the nearest slope at every place of the view."""
    height, width = slope.shape
    place = np.empty(width, np.int32)
    for v in range(height):
        row = slope[v]
        _move(row, v, height, width, x_step, y_step, place)
        for u in range(width):
            k = np.uintp(np.uint32(place[u]))
            nearest[k] = max(nearest[k], row[u])


@kernel()
def _look(
    slope: NDArray[np.float32],
    wide: int,
    x_step: np.float32,
    y_step: np.float32,
    jump: np.float32,
    nearest: NDArray[np.float32],
    hidden: NDArray[np.bool_],
) -> None:
    """Mark who lies behind the nearest slope at its place, in a picture of a width."""
    height, width = slope.shape
    place = np.empty(width, np.int32)
    for v in range(height):
        row, marks = slope[v], hidden[v]
        _move(row, v, height, wide, x_step, y_step, place)
        for u in range(width):
            k = np.uintp(np.uint32(place[u]))
            marks[u] = nearest[k] > row[u] + jump


@kernel()
def _move(
    row: NDArray[np.float32],
    v: int,
    height: int,
    wide: int,
    x_step: np.float32,
    y_step: np.float32,
    place: NDArray[np.int32],
) -> None:
    """Index of the pixel of the view where each point of row v lands; one past the last outside.

    A row shorter than the picture is that of a thin map.
    """
    width = len(row)
    apart = np.int32(1 if width == wide else 2)
    first, end = np.int32((apart - 1) * (v % 2)), np.int32(wide - 1)
    half, here = np.float32(0.5), np.float32(v)
    right, bottom = np.float32(wide), np.float32(height)
    stride, outside = np.int32(wide), np.int32(height * wide)
    for u in range(width):
        column = min(np.int32(np.int32(np.int32(u) * apart) + first), end)
        x = np.float32(column) - row[u] * x_step + half
        y = here - row[u] * y_step + half
        inside = min(x, right - x, y, bottom - y) > 0
        x = x if inside else half
        y = y if inside else half
        index = np.int32(np.int32(np.int32(y) * stride) + np.int32(x))
        place[u] = index if inside else outside
