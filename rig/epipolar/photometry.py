"""Brings all views to the reference's grey scale: one gain and one offset per view.

Cameras of one rig differ by a few per cent. A coarse match (a quarter of the size) tells which
pixels show the same point; the grey values of these pairs give gain and offset by robust
regression.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.sampling import sample_view
from rig.epipolar.scales import Scales
from rig.epipolar.search import Cameras, Window, search

_SHRINK = 4
_MIN_SIDE_PX = 16
_ROUNDS = 4
_PAIRS = 2000
_QUANTILES = np.linspace(0.05, 0.95, 19)


def equalise(images: NDArray[np.float32], cameras: Cameras, window: Window) -> NDArray[np.float32]:
    """Return the images (V, H, W) with every view on the grey scale of the reference view."""
    reference = cameras.reference
    first = _match_quantiles(images, reference)
    shrink = _SHRINK if min(images.shape[1:]) >= _SHRINK * _MIN_SIDE_PX else 1
    size = (images.shape[2] // shrink, images.shape[1] // shrink)
    small = np.stack(
        [
            np.float32(gain) * cv2.resize(image, size, interpolation=cv2.INTER_AREA)
            + np.float32(offset)
            for image, (gain, offset) in zip(images, first, strict=True)
        ]
    )
    scales = Scales(noise=0.1 * float(np.std(small[reference])) + 1e-6, texture=0.0)
    slope = search(small, cameras, window.shrunk(shrink), scales)
    equal = np.empty_like(images)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            gain, offset = first[i]
            if i != reference:
                x, y = float(cameras.x_steps[i]), float(cameras.y_steps[i])
                better, shift = _compare(small[i], small[reference], x, y, slope)
                gain, offset = better * gain, better * offset + shift
            np.multiply(images[i], np.float32(gain), out=equal[i])
            equal[i] += np.float32(offset)

    run_in_bands(work, len(images))
    return equal


def _match_quantiles(images: NDArray[np.float32], reference: int) -> list[tuple[float, float]]:
    """First gain and offset of each view: the same share of pixels is darker than a quantile."""
    samples = images[:, ::8, ::8].reshape(len(images), -1)
    spread = np.quantile(samples, _QUANTILES, axis=1).T
    return [_gain_offset(quantiles, spread[reference]) for quantiles in spread]


def _compare(
    image: NDArray[np.float32],
    target: NDArray[np.float32],
    x_step: float,
    y_step: float,
    slope_px: NDArray[np.float32],
) -> tuple[float, float]:
    """Gain and offset that bring one matched view to the reference."""
    seen, grey = sample_view(image, x_step, y_step, slope_px)
    pairs = np.flatnonzero(seen)
    if len(pairs) < _MIN_SIDE_PX**2 // 2:
        return 1.0, 0.0
    pairs = pairs[:: max(1, len(pairs) // _PAIRS)]
    return _gain_offset(grey.ravel()[pairs], target.ravel()[pairs])


def _gain_offset(grey: NDArray[np.floating], target: NDArray[np.floating]) -> tuple[float, float]:
    """Robust line target = gain * grey + offset; symmetric, so that noise does not flatten it."""
    gain, offset = 1.0, float(np.median(target) - np.median(grey))
    x, y = grey.astype(np.float64), target.astype(np.float64)
    for _ in range(_ROUNDS):
        misfit = y - gain * x - offset
        scale = 1.5 * float(np.median(np.abs(misfit))) + 1e-3 * float(np.std(y)) + 1e-9
        weight = 1.0 / (1.0 + (misfit / scale) ** 2)
        weight /= weight.sum()
        mean_x, mean_y = float((weight * x).sum()), float((weight * y).sum())
        var_x = float((weight * (x - mean_x) ** 2).sum())
        var_y = float((weight * (y - mean_y) ** 2).sum())
        if var_x <= 0 or var_y <= 0:
            return 1.0, mean_y - mean_x
        gain = float(np.sqrt(var_y / var_x))
        offset = mean_y - gain * mean_x
    return gain, offset
