"""Brings all views to the reference's grey scale: one gain and one offset per view.

Cameras of one rig differ by a few per cent. A coarse match (a quarter of the size) tells which
pixels show the same point; the grey values of these pairs give gain and offset by robust
regression.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.aggregate import aggregate, winners
from rig.epipolar.sampling import sample_view
from rig.epipolar.sweep import sweep_costs

_SHRINK = 4
_MIN_SIDE_PX = 16
_ROUNDS = 6
_PAIRS = 4000
_QUANTILES = np.linspace(0.05, 0.95, 19)


def equalise(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    slope_range_px: tuple[float, float],
) -> NDArray[np.float32]:
    """Return the images (V, H, W) with every view on the grey scale of the reference view."""
    spread = np.quantile(images[:, ::4, ::4].reshape(len(images), -1), _QUANTILES, axis=1).T
    first = [_gain_offset(quantiles, spread[reference]) for quantiles in spread]
    shrink = _SHRINK if min(images.shape[1:]) >= _SHRINK * _MIN_SIDE_PX else 1
    height, width = (side // shrink for side in images.shape[1:])
    small = np.stack(
        [
            np.float32(gain) * cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
            + np.float32(offset)
            for image, (gain, offset) in zip(images, first, strict=True)
        ]
    )
    reach = float(np.hypot(x_steps, y_steps).max())
    low, high = (bound / shrink for bound in slope_range_px)
    count = max(2, int(np.ceil((high - low) * reach / 0.5)) + 1)
    labels = np.linspace(low, high, count).astype(np.float32)
    contrast = float(np.std(small[reference])) + 1e-6
    costs = sweep_costs(small, x_steps, y_steps, reference, labels, 0.3 * contrast)
    jumps = np.full((height, width), 24, np.int16)
    slope = winners(aggregate(costs, jumps, jumps, 6), labels)
    equal = images.copy()
    for i, (gain, offset) in enumerate(first):
        if i == reference:
            continue
        seen, grey = sample_view(small[i], float(x_steps[i]), float(y_steps[i]), slope)
        if np.count_nonzero(seen) > _MIN_SIDE_PX**2 // 2:
            pairs = np.flatnonzero(seen)
            pairs = pairs[:: max(1, len(pairs) // _PAIRS)]
            better, shift = _gain_offset(grey.ravel()[pairs], small[reference].ravel()[pairs])
            gain, offset = better * gain, better * offset + shift
        equal[i] = np.float32(gain) * images[i] + np.float32(offset)
    return equal


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
