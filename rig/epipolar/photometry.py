"""Brings all views to the reference's grey scale: one gain and one offset per view.

Cameras of one rig differ by a few per cent. A coarse match (a quarter of the size) tells which
pixels show the same point; the grey values of these pairs give gain and offset by robust
regression.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.gains import Gains, fit_gains, middle
from rig.epipolar.rank import mean
from rig.epipolar.sampling import pad, sample_views
from rig.epipolar.scales import Scales
from rig.epipolar.search import search, wide_share
from rig.epipolar.shrink import shrink
from rig.epipolar.usable import saturation_grey
from rig.epipolar.views import Image
from rig.epipolar.window import Cameras, Window

_SHRINK = 4
_MIN_SIDE_PX = 48
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
        first = Gains.none(len(images))
        small = small.astype(np.float32)
        slope = small_window.expected_px
    soft = np.stack([mean(image, 1) for image in small])  # what sampling would smooth is gone
    second, agreement = _match_pairs(soft, cameras, slope, first.of(clip))
    return _apply(images, second.after(first)), agreement


def _apply(images: Image, gains: Gains) -> NDArray[np.float32]:
    equal = np.empty(images.shape, np.float32)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            np.multiply(images[i], np.float32(gains.gain[i]), out=equal[i], dtype=np.float32)
            equal[i] += np.float32(gains.offset[i])

    run_in_bands(work, len(images))
    return equal


def _match_quantiles(images: Image, reference: int, clip: float) -> Gains:
    """First gain and offset of each view: the same share of pixels is darker than a quantile.

    Quantiles that are clipped in any view do not count, as long as two are left.
    """
    stride = _stride(images.shape[1], images.shape[2])
    samples = images[:, ::stride, ::stride].reshape(len(images), -1).astype(np.float32)
    samples.sort(axis=1)
    spread = samples[:, (_QUANTILES * (samples.shape[1] - 1)).astype(int)]
    clear = (spread < _CLIPPED * clip).all(axis=0)
    clear |= np.count_nonzero(clear) < 2
    spread = spread[:, clear]
    return fit_gains(spread, spread[reference], np.ones(spread.shape, np.bool_))


def _stride(height: int, width: int) -> int:
    return max(1, round((height * width / _PAIRS) ** 0.5))


def _match_pairs(
    images: NDArray[np.float32],
    cameras: Cameras,
    slope_px: NDArray[np.float32],
    clips: NDArray[np.float64],
) -> tuple[Gains, NDArray[np.float64]]:
    """Gain and offset of each view from pixels that show the same point as the reference.

    Pairs with a member near the grey value where its view is clipped say nothing.
    """
    height, width = slope_px.shape
    stride = _stride(height, width)
    grid = np.mgrid[stride // 2 : height : stride, stride // 2 : width : stride]
    rows, columns = grid.reshape(2, -1)
    padded = pad(images, cameras.x_steps, cameras.y_steps)
    seen, grey = sample_views(
        padded, slope_px.shape, cameras.x_steps, cameras.y_steps, rows, columns,
        slope_px[rows, columns],
    )  # fmt: skip
    target = grey[cameras.reference]
    useful = seen & (grey < _CLIPPED * clips[:, None])
    useful &= useful[cameras.reference]
    told = np.count_nonzero(useful, axis=1) >= _FEWEST_PAIRS
    told[cameras.reference] = False
    found, agreement = Gains.none(len(images)), np.ones(len(images))
    if told.any():
        x, useful = grey[told], useful[told]
        gains = fit_gains(x, target, useful)
        found.gain[told], found.offset[told] = gains.gain, gains.offset
        misfit = middle(np.abs(gains.misfit(x, target)), useful)
        unrelated = middle(np.abs(target - np.roll(target, len(target) // 2))[None], useful)
        agreement[told] = 1.0 - misfit / (unrelated + 1e-9)
    return found, agreement
