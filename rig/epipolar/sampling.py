"""Grey values and their derivatives between the pixels of a view, along the epipolar line.

Cubic B-splines (Unser, "Splines: a perfect fit", 1999): exact at the pixels, and between them
without the bias towards whole pixels of shorter kernels. A view that moves along one axis only is a
spline along that one. The coefficients are padded, so that no tap needs a border check. Where to
look, fetching and weighing are loops of their own: only the middle one cannot be vectorised.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.spline import INVERSE

_PAD = 2
_AS_IT_IS = np.ones(1)
_FEW = 8192
"""Samples that are taken in less time than a thread needs to wake up."""
_TAPS = 4
_BEFORE, _HERE, _AFTER, _BEYOND = range(_TAPS)
"""The coefficients that a value is made of: two on each side of it."""
_X, _Y = range(2)


def pad(
    images: NDArray[np.float32], x_steps: NDArray[np.float64], y_steps: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the spline coefficients of (V, H, W) images, (V, (H + 4) * (W + 4)).

    Along the axes only that each view moves along, the row for one that does not move; mirrored at
    the border.
    """
    views, height, width = images.shape
    padded = np.empty((views, height + 2 * _PAD, width + 2 * _PAD), np.float32)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            down = INVERSE if y_steps[i] != 0 else _AS_IT_IS
            along = INVERSE if x_steps[i] != 0 or y_steps[i] == 0 else _AS_IT_IS
            spline = cv2.sepFilter2D(
                images[i], cv2.CV_32F, along, down, borderType=cv2.BORDER_REFLECT_101
            )
            cv2.copyMakeBorder(spline, _PAD, _PAD, _PAD, _PAD, cv2.BORDER_REFLECT_101, padded[i])

    run_in_bands(work, views)
    return padded.reshape(views, -1)


def sample_views(
    padded: NDArray[np.float32],
    shape: tuple[int, int],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    slope_px: NDArray[np.float32],
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Whether each view shows some reference pixels, and with which grey values, both (V, N).

    Args:
        padded: coefficients of the views, see `pad`.
        shape: height and width of the views, px.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        rows: (N,) rows in the reference view.
        columns: (N,) columns in the reference view.
        slope_px: (N,) slope of each of them.
    """
    u, v = columns.astype(np.float32), rows.astype(np.float32)
    grey, _, seen = sample_tilts(padded, shape, x_steps, y_steps, u, v, slope_px)
    return seen, grey


def sample_tilts(
    padded: NDArray[np.float32],
    shape: tuple[int, int],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    columns: NDArray[np.float32],
    rows: NDArray[np.float32],
    slope_px: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """Sample views where they show points (N,) of the reference, at any places.

    Returns:
        Grey values, their derivatives by the slope, and whether each view shows the point; all
        (V, N).
    """
    views, (height, width) = len(padded), shape
    xs, ys = x_steps.astype(np.float32), y_steps.astype(np.float32)
    grey, tilt, seen = np.empty((3, views, len(rows)), np.float32)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            sample_points(
                padded[i], height, width, columns, rows, slope_px, xs[i], ys[i], grey[i], tilt[i],
                seen[i],
            )  # fmt: skip

    if views * len(rows) < _FEW:
        work(0, views)
    else:
        run_in_bands(work, views)
    return grey, tilt, seen > 0


@kernel()
def sample_points(
    padded: NDArray[np.float32],
    height: int,
    width: int,
    columns: NDArray[np.float32],
    rows: NDArray[np.float32],
    slope: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    grey: NDArray[np.float32],
    tilt: NDArray[np.float32],
    seen: NDArray[np.float32],
) -> None:
    """Sample one padded view where it shows the reference pixels (columns, rows), each (N,).

    Fills grey value, its derivative by the slope, and 1 where the point lies inside the view (0
    where it does not; grey value and derivative are then those at the reference pixel).
    """
    count = len(slope)
    place = np.empty(count, np.int32)
    shares = np.empty((2, count), np.float32)
    taps = np.empty((_TAPS, count), np.float32)
    _locate(height, width, columns, rows, slope, x_step, y_step, place, shares, seen)
    stride = width + 2 * _PAD
    if y_step == 0:
        _fetch(padded, place, 1, taps)
        _weigh(taps, shares[_X], -x_step, grey, tilt)
    elif x_step == 0:
        _fetch(padded, place, stride, taps)
        _weigh(taps, shares[_Y], -y_step, grey, tilt)
    else:
        # Along four rows first, then down what they give: the derivative by the slope is
        # -x_step * d/dx - y_step * d/dy, and the part of d/dx is weighed down like a value.
        values, tilts = np.empty((_TAPS, count), np.float32), np.empty((_TAPS, count), np.float32)
        by_x, unused = np.empty(count, np.float32), np.empty(count, np.float32)
        for u in range(count):
            place[u] -= np.int32(stride)
        for k in range(_TAPS):
            _fetch(padded[k * stride :], place, 1, taps)
            _weigh(taps, shares[_X], -x_step, values[k], tilts[k])
        _weigh(tilts, shares[_Y], np.float32(1), by_x, unused)
        _weigh(values, shares[_Y], -y_step, grey, tilt)
        for u in range(count):
            tilt[u] += by_x[u]


@kernel()
def _locate(
    height: int,
    width: int,
    columns: NDArray[np.float32],
    rows: NDArray[np.float32],
    slope: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    place: NDArray[np.int32],
    shares: NDArray[np.float32],
    seen: NDArray[np.float32],
) -> None:
    """Index of the pixel up and left of each point, and how far beyond it the point lies."""
    right, bottom = np.float32(width - 1), np.float32(height - 1)
    stride = np.int32(width + 2 * _PAD)
    corner = np.int32(_PAD) * stride + np.int32(_PAD)
    share_x, share_y = shares[_X], shares[_Y]
    for u in range(len(slope)):
        x = columns[u] - slope[u] * x_step
        y = rows[u] - slope[u] * y_step
        inside = min(x, right - x, y, bottom - y) >= 0
        x = x if inside else columns[u]
        y = y if inside else rows[u]
        ix, iy = np.int32(x), np.int32(y)
        place[u] = np.int32(np.int32(iy * stride) + ix) + corner
        share_x[u] = x - np.float32(ix)
        share_y[u] = y - np.float32(iy)
        seen[u] = np.float32(1) if inside else np.float32(0)


@kernel()
def _fetch(
    padded: NDArray[np.float32], place: NDArray[np.int32], step: int, taps: NDArray[np.float32]
) -> None:
    """Four pixels in a line around each place, `step` apart."""
    before, here, after, beyond = taps[_BEFORE], taps[_HERE], taps[_AFTER], taps[_BEYOND]
    reach = np.uintp(step)
    for u in range(len(place)):
        k = np.uintp(np.uint32(place[u]))
        before[u] = padded[k - reach]
        here[u] = padded[k]
        after[u] = padded[k + reach]
        beyond[u] = padded[k + reach + reach]


@kernel()
def _weigh(
    taps: NDArray[np.float32],
    shares: NDArray[np.float32],
    per_slope: np.float32,
    value: NDArray[np.float32],
    tilt: NDArray[np.float32],
) -> None:
    """Uniform cubic B-spline: its value between the middle two coefficients, and its derivative.

    value = (a + 4 b + c) / 6 + k1 t + k2 t^2 + k3 t^3 for coefficients a..d and a share t of the
    way from b to c; the tilt is `per_slope` times its derivative by t.
    """
    before, here, after, beyond = taps[_BEFORE], taps[_HERE], taps[_AFTER], taps[_BEYOND]
    half, sixth = np.float32(0.5), np.float32(1 / 6)
    two, three = np.float32(2), np.float32(3)
    for u in range(len(value)):
        a, b, c, d, t = before[u], here[u], after[u], beyond[u], shares[u]
        k1 = half * (c - a)
        k2 = half * (a + c) - b
        k3 = sixth * (d - a) + half * (b - c)
        value[u] = b + sixth * (a - two * b + c) + t * (k1 + t * (k2 + t * k3))
        tilt[u] = per_slope * (k1 + t * (two * k2 + three * t * k3))
