"""What views differ by where they show the same: noise that a single picture hides, and misfit.

A picture tells its noise by its finest structure, which JPEG, denoising cameras, resampling and
defocus empty; what two views differ by after a match they cannot hide. Blocks of the reference are
brought to their best slope; what is left grows with the square of the gradient by what lines miss
each other (rows, sampling, lenses), and the rest is noise: the linear regression by which the
photon transfer method parts read noise from light (J. R. Janesick, "Photon Transfer", SPIE 2007),
with the squared gradient in the place of the light.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.epipolar.noise.model import CrossNoise, NoiseModel
from rig.epipolar.sampling import pad, sample_tilts
from rig.epipolar.search.window import Cameras

_BLOCKS, _MOST_BLOCKS, _SIDE_PX = 2800, 700, 7
"""Over all views, and of one."""
_ROUNDS, _REACH_PX = 2, 1.5
_FEWEST = 60
_QUIET_SHARE = 0.4
"""Share of the blocks, those of least gradient, that tell the noise."""
_SAMPLED_POWER = 0.75
"""Mean power of white noise in a sample between pixels (cubic B-spline) over that on a pixel."""
_CLEAR, _SEEN_SHARE = 4.0, 0.25
_USUAL = 1.3
_LEAST_MISFIT_PX = 0.15
"""Below it lines meet."""


def measure_cross_noise(
    images: NDArray[np.float32],
    cameras: Cameras,
    slope_px: NDArray[np.float32],
    model: NoiseModel,
) -> CrossNoise:
    """Compare what blocks differ by with the noise of one picture.

    Args:
        images: (V, H, W) grey values whose rows and light agree.
        cameras: where the views stand.
        slope_px: (H, W) rough slopes.
        model: noise of one picture.
    """
    blocks = min(_MOST_BLOCKS, _BLOCKS // max(len(images) - 1, 1))
    rows, columns = _grid((images.shape[1], images.shape[2]), blocks)
    if len(rows) < _FEWEST:
        return CrossNoise()
    dy, dx = np.mgrid[:_SIDE_PX, :_SIDE_PX] - _SIDE_PX // 2
    v = (rows[:, None] + dy.ravel()).astype(np.float32)
    u = (columns[:, None] + dx.ravel()).astype(np.float32)
    own = images[cameras.reference][v.astype(int), u.astype(int)].astype(np.float64)
    slope = slope_px[rows, columns].astype(np.float64)
    padded = pad(images, cameras.x_steps, cameras.y_steps)
    reach_px = _REACH_PX / float(np.hypot(cameras.x_steps, cameras.y_steps).max())
    others = np.flatnonzero(np.hypot(cameras.x_steps, cameras.y_steps) > 0)
    begun = slope.copy()
    left, tilt, seen = _differences(images, padded, others, cameras, u, v, slope, own)
    step = _best_step(left, tilt)
    for _ in range(_ROUNDS):
        slope = np.clip(slope + step, begun - reach_px, begun + reach_px)
        left, tilt, seen = _differences(images, padded, others, cameras, u, v, slope, own)
        step = _best_step(left, tilt)
    # What the last step would have mended is no noise.
    left = left + step[None, :, None] * tilt
    pixels = _SIDE_PX**2
    freedom = np.maximum(seen.sum(axis=0) * (pixels - 1.0) - 1.0, 1.0)
    scatter = (left**2).sum(axis=(0, 2)) / freedom / (1.0 + _SAMPLED_POWER)
    reach = np.hypot(cameras.x_steps[others], cameras.y_steps[others])[:, None, None]
    steep = ((tilt / reach) ** 2).sum(axis=(0, 2)) / np.maximum(seen.sum(axis=0) * pixels, 1)
    expected = np.array([model.sigma_levels(level) ** 2 for level in own.mean(axis=1)])
    used = seen.any(axis=0) & (scatter > 0)
    if np.count_nonzero(used) < _FEWEST:
        return CrossNoise()
    scatter, steep, expected = scatter[used], steep[used], expected[used]
    parted = _parted(scatter, steep, expected)
    # Blocks at jumps, and wrong ones, are alike in what they show, not in their noise.
    usual = scatter / (parted.excess**2 * expected + parted.misfit_px**2 * steep)
    clean = usual < _USUAL * np.median(usual)
    return replace(parted, likeness=_likeness(left[:, used][:, clean], scatter[clean]))


def _grid(shape: tuple[int, int], blocks: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    height, width = shape
    border = _SIDE_PX // 2 + 1
    stride = max(_SIDE_PX, round((height * width / blocks) ** 0.5))
    rows, columns = np.mgrid[border : height - border : stride, border : width - border : stride]
    return rows.ravel(), columns.ravel()


def _best_step(left: Float, tilt: Float) -> Float:
    """Change of slope that differences (views, N, pixels) ask for, (N,)."""
    power = np.maximum((tilt**2).sum(axis=(0, 2)), 1e-9)
    return -(tilt * left).sum(axis=(0, 2)) / power


def _differences(
    images: NDArray[np.float32],
    padded: NDArray[np.float32],
    others: NDArray[np.intp],
    cameras: Cameras,
    u: NDArray[np.float32],
    v: NDArray[np.float32],
    slope: Float,
    own: Float,
) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Differences to the reference and tilts (views, N, pixels), means of each block taken off.

    And which blocks each view shows whole, (views, N); those that it does not are zero.
    """
    shape = (images.shape[1], images.shape[2])
    each = np.repeat(slope.astype(np.float32), u.shape[1])
    grey, tilt, inside = sample_tilts(
        padded[others], shape, cameras.x_steps[others], cameras.y_steps[others],
        u.ravel(), v.ravel(), each,
    )  # fmt: skip
    blocks = (len(others), *u.shape)
    seen = np.empty(blocks[:2], np.bool_)
    left, slopes = np.empty(blocks, np.float64), np.empty(blocks, np.float64)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            seen[i] = np.logical_and.reduce(inside[i].reshape(u.shape), axis=1)
            np.subtract(grey[i].reshape(u.shape), own, out=left[i])
            slopes[i] = tilt[i].reshape(u.shape)
            for part in (left[i], slopes[i]):
                part -= part.mean(axis=1, keepdims=True)
                part[~seen[i]] = 0.0

    run_in_bands(work, len(others))
    return left, slopes, seen


def _parted(scatter: Float, steep: Float, expected: Float) -> CrossNoise:
    """Part the variance of blocks (N,) into noise and misfit times squared gradient."""
    order = np.argsort(steep, kind="stable")
    few = max(int(_QUIET_SHARE * len(order)), 1)
    quiet, rough = order[:few], order[-few:]
    share, misfit = 1.0, 0.0
    for _ in range(4):
        rest = np.maximum(scatter[quiet] - misfit * steep[quiet], 0.0) / expected[quiet]
        share = max(float(np.median(rest)), 0.0)
        # Where noise makes up the gradients, they tell nothing.
        clear = steep[rough] > _CLEAR * share * expected[rough]
        if np.count_nonzero(clear) >= _FEWEST // 2:
            more = (scatter[rough] - share * expected[rough])[clear] / steep[rough][clear]
            misfit = max(float(np.median(more)), 0.0)
    ratio, misfit_px = max(share, 1e-6) ** 0.5, misfit**0.5
    # Beside much noise, what little the gradients explain may be chance.
    least = _SEEN_SHARE * share * float(np.median(expected[rough]))
    is_seen = misfit * float(np.median(steep[rough])) > least
    return CrossNoise(
        ratio,
        misfit_px if is_seen and misfit_px > _LEAST_MISFIT_PX else 0.0,
    )


def _likeness(left: Float, scatter: Float) -> Float:
    """Correlation of differences (views, N, pixels) at pixels up to three apart, (7, 7).

    JPEG, denoising and resampling make neighbours alike, so that many say less than they seem to.
    """
    side, reach = _SIDE_PX, _SIDE_PX // 2
    blocks = (left / np.sqrt(scatter)[:, None]).reshape(-1, side, side)
    likeness = np.zeros((side, side))
    lags = [(dy, dx) for dy in range(reach + 1) for dx in range(-reach, reach + 1)]

    def work(start: int, stop: int) -> None:
        for dy, dx in lags[start:stop]:
            one = blocks[:, : side - dy, max(-dx, 0) : side - max(dx, 0)]
            other = blocks[:, dy:, max(dx, 0) : side + min(dx, 0)]
            mean = float((one * other).sum()) / (one[0].size * len(blocks))
            likeness[reach + dy, reach + dx] = likeness[reach - dy, reach - dx] = mean

    run_in_bands(work, len(lags))
    # Each block has lost its mean, which pulls every product down by the variance of that mean.
    return _with_means(likeness / likeness[reach, reach])


def _with_means(likeness: Float) -> Float:
    """Correlations as they were before the mean of each block was taken off."""
    reach = _SIDE_PX // 2
    lags = np.abs(np.arange(-reach, reach + 1))
    pairs = np.outer(_SIDE_PX - lags, _SIDE_PX - lags) / _SIDE_PX**4
    lost = 0.0
    for _ in range(10):
        whole = likeness * (1.0 - lost) + lost
        lost = min(max(float((pairs * whole).sum()), 0.0), 0.9)
    return likeness * (1.0 - lost) + lost
