"""Grey noise around every pixel, and what of it reaches the slope.

One noise for the whole picture does not fit dark and bright parts alike, nor what no noise model
knows: reflections, wrong positions, blur. What the views of a line disagree by after the fit tells
it on the spot: the residual variance of a least-squares fit (Gauss, "Theoria combinationis
observationum", 1823), pooled over neighbours. The variance of a robust fit follows P. J. Huber,
"Robust estimation of a location parameter" (Annals of Mathematical Statistics 35, 1964).
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands, run_side_by_side
from rig.epipolar.line import UNSEEN, LineFits
from rig.epipolar.rank import middle_of
from rig.epipolar.scales import Scales

_ENOUGH = 100.0
"""Degrees of freedom to pool: the standard deviation is then known to 7 per cent."""
_LARGEST_RADIUS_PX = 4
_NO_FREEDOM = 0.5
"""Degrees of freedom of a line below which it tells no noise of its own: a pair's."""
_LEAST_REPLY = 0.3
"""Below it a step is more noise than answer, and is not made much longer."""
_LOWEST = 0.25
"""Share of the power in the whole picture below which a place is quiet by chance."""

_LEAST_POOLED = 0.5
"""What chance can make of a measured correlation, and no noise."""
_STRIP_PX, _STRIP_EVERY_PX = 32, 96
"""Height and distance of the strips that stand for a whole picture."""


def line_precision(lines: LineFits, scales: Scales) -> NDArray[np.float32]:
    """Precision of each pixel's own line, 1 / (px per view step)^2, (H, W)."""
    each = middle_of(lines.freedom[::4, ::4])
    if each < _NO_FREEDOM:
        scatter, freedom = _of_shared_slopes(lines)
    else:
        side_px = (_ENOUGH / max(each, 1.0)) ** 0.5
        radius_px = min(int(np.ceil(0.5 * (side_px - 1))), _LARGEST_RADIUS_PX)
        scatter, freedom = run_side_by_side(
            lambda: lines.around(lines.scatter, radius_px),
            lambda: lines.around(lines.freedom, radius_px),
        )
    in_scatter, in_step, _ = _cauchy_shares(scales)
    lowest = _LOWEST * in_scatter * scales.smoothed_noise**2
    precision = np.empty_like(scatter)

    def work(start: int, stop: int) -> None:
        r = slice(start, stop)
        power = scatter[r] / np.maximum(freedom[r], np.float32(1e-3))
        np.maximum(power, np.float32(lowest), out=power)
        np.divide(lines.information[r], power, out=power)
        np.multiply(power, np.float32(in_scatter / in_step), out=precision[r])

    run_in_bands(work, len(precision))
    return precision


def _of_shared_slopes(lines: LineFits) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Scatter and freedom of lines that share the slope of their surroundings.

    A line through two views has a slope and a grey value of its own, and nothing left to tell the
    noise by; with a slope that neighbours share, each has one difference left.
    """
    radius_px = _LARGEST_RADIUS_PX
    known = np.maximum(lines.around(lines.information, radius_px), np.float32(1e-12))
    shared_px = lines.around(lines.information * lines.slope_px, radius_px) / known
    apart = lines.scatter + lines.information * np.square(lines.slope_px - shared_px)
    left = np.float32(1.0 - 1.0 / (2 * radius_px + 1) ** 2)
    one = np.where(lines.sight == UNSEEN, np.float32(0), left).astype(np.float32)
    return lines.around(apart, radius_px), lines.around(one, radius_px)


def reply_share(lines: LineFits, scales: Scales) -> float:
    """Share of the start's error that one step of all lines together mends.

    Noise makes lines look steeper than they are, and Cauchy weights, which fall with the very
    differences that tell the error, hold each step back.
    """
    real, every = (float(part.sum(dtype=np.float64)) for part in (lines.signal, lines.information))
    if every == 0:
        return 1.0
    return max(_cauchy_shares(scales)[2] * real / every, _LEAST_REPLY)


@lru_cache(maxsize=8)  # most frames have the scales of the frame before
def locking(scales: Scales) -> tuple[float, float, float]:
    """`Scales.locking` as it reaches the steps of lines through their Cauchy weights.

    A covariance passes a function by that function's mean derivative: C. M. Stein, "Estimation of
    the mean of a multivariate normal distribution" (Annals of Statistics 9, 1981).
    """
    in_reply = _cauchy_shares(scales)[2]
    c1, c3, c5 = scales.locking
    return c1 * in_reply, c3 * in_reply, c5 * in_reply


def pooled_share(
    grey: NDArray[np.float32],
    scales: Scales,
    stride_px: int,
    likeness: NDArray[np.float64] | None = None,
) -> float:
    """Variance of many lines' mean over that of as many independent ones.

    The prefilter makes the noise of neighbours alike, and so do JPEG, denoising and resampling
    before it. What such noise is in a sum over the pixels of a chess-board, weighted by their grey
    slopes, is told by how alike that pattern of grey slopes is to itself.

    Args:
        grey: (H, W) reference view, prefiltered.
        scales: grey scales of the images.
        stride_px: distance of the pixels that are joined, along a row of the chess-board.
        likeness: (7, 7) correlation of the noise before the prefilter, None for white noise.
    """
    if scales.prefilter_px == 0 and likeness is None:
        return 1.0
    single = np.zeros((_STRIP_PX, _STRIP_PX), np.float32)
    single[_STRIP_PX // 2, _STRIP_PX // 2] = 1.0
    _, alone = _kept_power(single, scales.prefilter_px, likeness)
    strips = [grey[v : v + _STRIP_PX] for v in range(0, len(grey), _STRIP_EVERY_PX)]
    rows, columns = np.ogrid[:_STRIP_PX, : grey.shape[1]]
    joined = ((rows + columns) % stride_px == 0).astype(np.float32)
    kept = power = 0.0
    for strip in strips:
        for axis in (0, 1):
            slope = cv2.Sobel(strip, cv2.CV_32F, axis, 1 - axis, ksize=1) * joined[: len(strip)]
            own, left = _kept_power(slope, scales.prefilter_px, likeness)
            kept, power = kept + left, power + own
    if power == 0 or alone <= 0:
        return 1.0
    return max(kept / power / alone, _LEAST_POOLED)


def _kept_power(
    weights: NDArray[np.float32], prefilter_px: float, likeness: NDArray[np.float64] | None
) -> tuple[float, float]:
    """Sum of squared weights (H, W), and the variance of a sum of noise so weighted."""
    soft = weights
    if prefilter_px > 0:
        soft = cv2.GaussianBlur(weights, (0, 0), prefilter_px)
    alike = soft if likeness is None else cv2.filter2D(soft, cv2.CV_32F, likeness)
    return float((weights * weights).sum()), float((soft * alike).sum())


@lru_cache(maxsize=8)  # asked several times for the same scales in every frame
def _cauchy_shares(scales: Scales) -> tuple[float, float, float]:
    """Shares of noise power in a line's scatter and in its step, and of an error in that step.

    Cauchy weights by the difference to the reference, which is noisy itself, favour views that
    happen to lie near it: expected values over Gaussian noise of a view and of the reference.
    """
    each = np.linspace(-4, 4, 81)
    likely = np.exp(-0.5 * each**2)
    # Of a view, sampled between its pixels (rows), to the reference (columns).
    difference = scales.sampled_share * each[:, None] - each
    per_scale = scales.smoothed_noise / scales.doubt
    weight = 1 / (1 + (difference * per_scale) ** 2)
    total = likely @ weight
    apart = difference - (likely @ (weight * difference)) / total
    answer = weight * (2 * weight - 1)  # derivative of the weighted difference by the difference
    parts = (weight * apart**2, weight**2 * apart**2, answer)
    in_scatter, in_step, in_reply = (
        float((likely @ part) @ likely / (total @ likely)) for part in parts
    )
    return in_scatter, in_step, in_reply
