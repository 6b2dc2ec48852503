"""Brings all views to the reference's grey scale: one gain and one offset per view.

Cameras of one rig differ by a few per cent. A coarse match (a quarter of the size) tells which
pixels show the same point; the grey values of these pairs give gain and offset by robust
regression.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.rank import mean
from rig.epipolar.sampling import sample_view
from rig.epipolar.scales import Scales
from rig.epipolar.search import search, wide_share
from rig.epipolar.shrink import shrink
from rig.epipolar.usable import saturation_grey
from rig.epipolar.views import Image
from rig.epipolar.window import Cameras, Window

_SHRINK = 4
_MIN_SIDE_PX = 48
_ROUNDS = 4
_PAIRS, _FEWEST_PAIRS = 2000, 100
_FEW_UNKNOWN = 0.3
_CLIPPED = 0.97
_QUANTILES = np.linspace(0.05, 0.95, 19)


def equalise(
    images: Image, cameras: Cameras, window: Window
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Bring every view to the grey scale of the reference view.

    Where nearly all slopes are known already, the match is left out: the hypothesis tells the
    pairs.

    Returns:
        The images (V, H, W); and how well each view agrees with the reference in what it shows,
        (V,): 1 minus its median difference over that of unrelated pixels.
    """
    factor = min(_SHRINK, max(1, min(images.shape[1:]) // _MIN_SIDE_PX))
    small = shrink(images, factor)
    small_window = window.shrunk(factor)
    clip = saturation_grey(images)
    if wide_share(small_window, cameras) > _FEW_UNKNOWN:
        first = _match_quantiles(images, cameras.reference, clip)
        small = _apply(small, first)
        scales = Scales(noise=0.1 * float(np.std(small[cameras.reference])) + 1e-6, texture=0.0)
        slope = search(small, cameras, small_window, scales)
    else:
        first = [(1.0, 0.0)] * len(images)
        small = small.astype(np.float32)
        slope = small_window.expected_px
    soft = np.stack([mean(image, 1) for image in small])  # what sampling would smooth is gone
    clips = [gain * clip + offset for gain, offset in first]
    second, agreement = _match_pairs(soft, cameras, slope, clips)
    both = [(g * h, g * p + q) for (h, p), (g, q) in zip(first, second, strict=True)]
    return _apply(images, both), agreement


def _apply(images: Image, gains_offsets: list[tuple[float, float]]) -> NDArray[np.float32]:
    equal = np.empty(images.shape, np.float32)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            gain, offset = gains_offsets[i]
            np.multiply(images[i], np.float32(gain), out=equal[i], dtype=np.float32)
            equal[i] += np.float32(offset)

    run_in_bands(work, len(images))
    return equal


def _match_quantiles(images: Image, reference: int, clip: float) -> list[tuple[float, float]]:
    """First gain and offset of each view: the same share of pixels is darker than a quantile.

    Quantiles that are clipped in any view do not count, as long as two are left.
    """
    stride = _stride(images.shape[1], images.shape[2])
    samples = images[:, ::stride, ::stride].reshape(len(images), -1).astype(np.float32)
    samples.sort(axis=1)
    spread = samples[:, (_QUANTILES * (samples.shape[1] - 1)).astype(int)]
    clear = (spread < _CLIPPED * clip).all(axis=0)
    clear |= np.count_nonzero(clear) < 2
    return [_gain_offset(quantiles[clear], spread[reference][clear]) for quantiles in spread]


def _stride(height: int, width: int) -> int:
    return max(1, round((height * width / _PAIRS) ** 0.5))


def _match_pairs(
    images: NDArray[np.float32],
    cameras: Cameras,
    slope_px: NDArray[np.float32],
    clips: list[float],
) -> tuple[list[tuple[float, float]], NDArray[np.float64]]:
    """Gain and offset of each view from pixels that show the same point as the reference.

    Pairs with a member near the grey value where its view is clipped say nothing.
    """
    height, width = slope_px.shape
    stride = _stride(height, width)
    grid = np.mgrid[stride // 2 : height : stride, stride // 2 : width : stride]
    rows, columns = grid.reshape(2, -1)
    target = images[cameras.reference, rows, columns]
    slopes = slope_px[rows, columns]
    found = [(1.0, 0.0)] * len(images)
    agreement = np.ones(len(images))
    for i, image in enumerate(images):
        if i == cameras.reference:
            continue
        step = float(cameras.x_steps[i]), float(cameras.y_steps[i])
        seen, grey = sample_view(image, *step, rows, columns, slopes)
        useful = (
            seen & (target < _CLIPPED * clips[cameras.reference]) & (grey < _CLIPPED * clips[i])
        )
        if np.count_nonzero(useful) >= _FEWEST_PAIRS:
            x, y = grey[useful], target[useful]
            gain, offset = found[i] = _gain_offset(x, y)
            unrelated = _middle(np.abs(y - np.roll(y, len(y) // 2)))
            agreement[i] = 1.0 - _middle(np.abs(y - gain * x - offset)) / (unrelated + 1e-9)
    return found, agreement


def _gain_offset(grey: NDArray[np.floating], target: NDArray[np.floating]) -> tuple[float, float]:
    """Robust line target = gain * grey + offset; symmetric, so that noise does not flatten it."""
    x, y = grey.astype(np.float64), target.astype(np.float64)
    gain, offset = 1.0, _middle(y) - _middle(x)
    smallest = 1e-3 * float(np.std(y)) + 1e-9
    for _ in range(_ROUNDS):
        misfit = y - gain * x - offset
        scale = 1.5 * _middle(np.abs(misfit)) + smallest
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


def _middle(values: NDArray[np.floating]) -> float:
    """Median; of the middle two of an even number, the larger."""
    half = len(values) // 2
    return float(np.partition(values, half)[half])
