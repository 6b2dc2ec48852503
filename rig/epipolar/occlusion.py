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

_BAND_ROWS = 50


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
    asked = thinned(slope_px) if is_thin else slope_px
    covered = np.zeros((len(x_steps), *asked.shape), np.bool_)
    ends = _outermost(x_steps, y_steps)
    hidden = np.zeros((len(ends), *asked.shape), np.bool_)
    nowhere = np.empty((0, 0), np.bool_)

    def look(i: int, rows: slice | None) -> None:
        exact = hidden[ends.index(i)] if i in ends else nowhere
        step, jump = (np.float32(x_steps[i]), np.float32(y_steps[i])), np.float32(jump_px)
        if rows is not None:
            first, last, _ = rows.indices(len(slope_px))
            _look_along(slope_px, step[0], jump, margin_px, first, last, exact, covered[i])
        else:
            nearest, widened = _drawn(slope_px, step, margin_px)
            _look(asked, slope_px.shape[1], *step, jump, nearest, widened, exact, covered[i])

    # Views beside the reference are looked at by rows, which know nothing of each other.
    bands = [slice(v, v + _BAND_ROWS) for v in range(0, len(slope_px), _BAND_ROWS)]
    away = np.flatnonzero(np.hypot(x_steps, y_steps) > 0).tolist()
    tasks: list[tuple[int, slice | None]] = [(i, None) for i in away if y_steps[i] != 0]
    tasks += [(i, rows) for i in away if y_steps[i] == 0 for rows in bands]

    def work(start: int, stop: int) -> None:
        for task in tasks[start:stop]:
            look(*task)

    run_in_bands(work, len(tasks))
    return covered, np.logical_or.reduce(hidden, axis=0)


def _drawn(
    slope_px: NDArray[np.float32], step: tuple[np.float32, np.float32], margin_px: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Nearest slope at every place of a view, and within the margin, (H * W + 1,) each.

    The last place is outside the view, where nothing hides anything.
    """
    height, width = slope_px.shape
    nearest = np.full(height * width + 1, -np.inf, np.float32)
    _draw(slope_px, *step, nearest)
    nearest[-1] = -np.inf
    if margin_px == 0:
        return nearest, nearest
    widened = np.full_like(nearest, -np.inf)
    across, along = (2 * margin_px + 1 if moved != 0 else 1 for moved in (step[1], step[0]))
    cv2.dilate(
        nearest[:-1].reshape(height, width), np.ones((across, along), np.uint8),
        dst=widened[:-1].reshape(height, width),
    )  # fmt: skip
    return nearest, widened


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
    widened: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    covered: NDArray[np.bool_],
) -> None:
    """Mark who lies behind the nearest slope at its place, in a picture of a width.

    `covered` goes by what is widened by the margin. `hidden` may be empty.
    """
    height, width = slope.shape
    place = np.empty(width, np.int32)
    for v in range(height):
        row = slope[v]
        _move(row, v, height, wide, x_step, y_step, place)
        _mark(row, place, jump, widened, covered[v])
        if len(hidden) > 0:
            _mark(row, place, jump, nearest, hidden[v])


@kernel()
def _mark(
    row: NDArray[np.float32],
    place: NDArray[np.int32],
    jump: np.float32,
    nearest: NDArray[np.float32],
    marks: NDArray[np.bool_],
) -> None:
    for u in range(len(row)):
        marks[u] = nearest[np.uintp(np.uint32(place[u]))] > row[u] + jump


@kernel()
def _look_along(
    slope: NDArray[np.float32],
    x_step: np.float32,
    jump: np.float32,
    margin: int,
    start: int,
    stop: int,
    hidden: NDArray[np.bool_],
    covered: NDArray[np.bool_],
) -> None:
    """The same for a view beside the reference, where a row needs no other one.

    Its depth buffer stays in the first cache. Rows of `hidden` and `covered` are those of the
    picture, or thin ones.
    """
    width, thin = slope.shape[1], covered.shape[1]
    place, own, there = (
        np.empty(width, np.int32),
        np.empty(thin, np.float32),
        np.empty(thin, np.int32),
    )
    # Framed by the margin; one more place, the last, is outside the view.
    nearest = np.full(width + 2 * margin + 1, -np.inf, np.float32)
    widened = np.full(width + 1, -np.inf, np.float32)
    inner = nearest[margin:]
    stride = 1 if thin == width else 2
    for v in range(start, stop):
        row = slope[v]
        nearest[:] = np.float32(-np.inf)
        _move(row, 0, 1, width, x_step, np.float32(0), place)
        for u in range(width):
            k = np.uintp(np.uint32(place[u]))
            inner[k] = max(inner[k], row[u])
        inner[width] = np.float32(-np.inf)
        _widen(nearest, margin, widened[:width])
        odd = v % 2 * (stride - 1)
        for k in range(thin):
            u = min(stride * k + odd, width - 1)
            own[k], there[k] = row[u], place[u]
        _mark(own, there, jump, widened, covered[v])
        if len(hidden) > 0:
            _mark(own, there, jump, inner, hidden[v])


@kernel()
def _widen(row: NDArray[np.float32], margin: int, out: NDArray[np.float32]) -> None:
    """Fill in the largest of each value and those within the margin; `row` is framed by it."""
    out[:] = row[margin : margin + len(out)]
    for k in range(1, margin + 1):
        left, right, before = row[margin - k :], row[margin + k :], out.copy()
        for u in range(len(out)):
            out[u] = max(before[u], left[u], right[u])


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
