"""Smoothed cubic B-splines of pictures, sampled along epipolar lines.

OpenCV's `remap` and `warpAffine` round positions to 1/32 px, so nothing measured passes through
them.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel

Coefficients = NDArray[np.float32]

_REACH = 8
_POWERS = (np.sqrt(3.0) - 2.0) ** np.abs(np.arange(-_REACH, _REACH + 1))
INVERSE: Float = _POWERS / _POWERS.sum()
"""Taps that turn grey values along an axis into coefficients; cut off at 3e-5."""


def spline_coefficients(picture: NDArray[np.generic], smooth_px: float) -> Coefficients:
    """Return cubic B-spline coefficients of a picture smoothed by a Gaussian.

    Smoothing and the inverse of the B-spline (Unser, "Splines: a perfect fit", 1999) are one short
    filter, because the inverse's response, sqrt(3) (sqrt(3) - 2)^|k|, decays within a few pixels.

    Args:
        picture: (H, W) grey.
        smooth_px: sigma of the Gaussian; 0 for none.
    """
    taps = _taps(smooth_px)
    grey = np.ascontiguousarray(picture, np.float32)
    filtered = cv2.sepFilter2D(grey, cv2.CV_32F, taps, taps, borderType=cv2.BORDER_REFLECT_101)
    return filtered.astype(np.float32, copy=False)


def _taps(smooth_px: float) -> NDArray[np.float64]:
    reach = int(np.ceil(5 * smooth_px))
    gauss = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(smooth_px, 1e-9)) ** 2)
    taps = np.convolve(INVERSE, gauss)
    return taps / taps.sum()


@kernel()
def sample_lines(
    coefficients: NDArray[np.float32],
    places_px: NDArray[np.float64],
    rates: NDArray[np.float64],
    change_px: NDArray[np.float64],
    turns: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Follow the line of every point through all views.

    Args:
        coefficients: (V, H, W) of `spline_coefficients`.
        places_px: (V, 2, N) where the lines pass through the pictures at some slope; they must stay
            2 px inside.
        rates: (V, 2, N) how these places move per px of slope.
        change_px: (N,) slope to look at, less that slope.
        turns: (V, 2, 2) derivative of a picture's pixels by those of the common frame.

    Returns:
        Values (V, N), and the gradient (2, N) along x and y of the common frame, averaged over the
        views.
    """
    views, points = coefficients.shape[0], change_px.size
    value = np.empty((views, points))
    gradient = np.zeros((2, points))
    wx, wy, gx, gy = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    for view in range(views):
        for point in range(points):
            x = places_px[view, 0, point] + change_px[point] * rates[view, 0, point]
            y = places_px[view, 1, point] + change_px[point] * rates[view, 1, point]
            column, row = int(np.floor(x)), int(np.floor(y))
            for weights, tilts, t in ((wx, gx, x - column), (wy, gy, y - row)):
                s = 1.0 - t
                weights[0] = s * s * s / 6.0
                weights[1] = 2.0 / 3.0 - 0.5 * t * t * (2.0 - t)
                weights[2] = 2.0 / 3.0 - 0.5 * s * s * (2.0 - s)
                weights[3] = t * t * t / 6.0
                tilts[0] = -0.5 * s * s
                tilts[1] = t * (1.5 * t - 2.0)
                tilts[2] = -s * (1.5 * s - 2.0)
                tilts[3] = 0.5 * t * t
            total, along_x, along_y = 0.0, 0.0, 0.0
            for j in range(4):
                line, rate = 0.0, 0.0
                for i in range(4):
                    c = coefficients[view, row - 1 + j, column - 1 + i]
                    line += wx[i] * c
                    rate += gx[i] * c
                total += wy[j] * line
                along_x += wy[j] * rate
                along_y += gy[j] * line
            value[view, point] = total
            gradient[0, point] += (
                along_x * turns[view, 0, 0] + along_y * turns[view, 1, 0]
            ) / views
            gradient[1, point] += (
                along_x * turns[view, 0, 1] + along_y * turns[view, 1, 1]
            ) / views
    return value, gradient
