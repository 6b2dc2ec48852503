"""Grey values and their derivatives between the pixels of a view, along the epipolar line.

Catmull and Rom, "A class of local interpolating splines" (1974): exact at the pixels, cubic between
them. The images are padded once, so that no tap needs a border check.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.kernel import kernel

_PAD = 2


def pad(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Repeat the border pixels of (V, H, W) images, and flatten each: (V, (H + 4) * (W + 4))."""
    padded = np.pad(images, ((0, 0), (_PAD, _PAD), (_PAD, _PAD)), mode="edge")
    return padded.reshape(len(images), -1)


def sample_view(
    image: NDArray[np.float32],
    x_step: float,
    y_step: float,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    slope_px: NDArray[np.float32],
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Whether one view shows the reference pixels (rows, columns), and with which grey value, (N,).

    Args:
        image: (H, W).
        x_step: column of the view, view steps.
        y_step: row of the view, view steps.
        rows: (N,) rows in the reference view.
        columns: (N,) columns in the reference view.
        slope_px: (N,) slope of each of them.
    """
    height, width = image.shape
    grey, tilt, seen = np.empty((3, len(rows)), np.float32)
    sample_points(
        pad(image[None])[0], height, width, columns.astype(np.float32), rows.astype(np.float32),
        slope_px, np.float32(x_step), np.float32(y_step), grey, tilt, seen,
    )  # fmt: skip
    return seen > 0, grey


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
    stride = np.uintp(width + 2 * _PAD)
    right, bottom = np.float32(width - 1), np.float32(height - 1)
    on_row, on_column = y_step == 0, x_step == 0
    step = np.uintp(1) if on_row else stride
    per_slope = -x_step if on_row else -y_step
    for u in range(len(slope)):
        x = columns[u] - slope[u] * x_step
        y = rows[u] - slope[u] * y_step
        inside = (x >= 0) & (x <= right) & (y >= 0) & (y <= bottom)
        x = x if inside else columns[u]
        y = y if inside else rows[u]
        ix, iy = np.int32(x), np.int32(y)
        fx, fy = x - np.float32(ix), y - np.float32(iy)
        k = np.uintp(iy + _PAD) * stride + np.uintp(ix + _PAD)
        seen[u] = np.float32(1) if inside else np.float32(0)
        if on_row or on_column:
            value, by_t = _spline(padded, k, step, fx if on_row else fy)
            grey[u] = value
            tilt[u] = per_slope * by_t
        else:
            v0, d0 = _spline(padded, k - stride, np.uintp(1), fx)
            v1, d1 = _spline(padded, k, np.uintp(1), fx)
            v2, d2 = _spline(padded, k + stride, np.uintp(1), fx)
            v3, d3 = _spline(padded, k + stride + stride, np.uintp(1), fx)
            value, by_y = _cubic(v0, v1, v2, v3, fy)
            by_x, _ = _cubic(d0, d1, d2, d3, fy)
            grey[u] = value
            tilt[u] = -(x_step * by_x + y_step * by_y)


@kernel()
def _spline(
    padded: NDArray[np.float32], k: np.uintp, step: np.uintp, t: np.float32
) -> tuple[np.float32, np.float32]:
    return _cubic(padded[k - step], padded[k], padded[k + step], padded[k + step + step], t)


@kernel()
def _cubic(
    a: np.float32, b: np.float32, c: np.float32, d: np.float32, t: np.float32
) -> tuple[np.float32, np.float32]:
    """Value and derivative at t between b (t = 0) and c (t = 1)."""
    half = np.float32(0.5)
    k1 = half * (c - a)
    k2 = a - np.float32(2.5) * b + np.float32(2) * c - half * d
    k3 = half * (d - a) + np.float32(1.5) * (b - c)
    value = b + t * (k1 + t * (k2 + t * k3))
    slope = k1 + t * (np.float32(2) * k2 + np.float32(3) * t * k3)
    return value, slope
