"""Whether a second, separate slope explains the views nearly as well: stripes, repetition.

The likelihood ratio of the two slopes over a patch (J. Neyman and E. S. Pearson, "On the problem of
the most efficient tests of statistical hypotheses", Phil. Trans. R. Soc. A 231, 1933), each by the
views of the better half of every axis, so that a hidden half does not decide.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.rank import mean
from rig.epipolar.sampling import sample_tilts
from rig.epipolar.scales import Scales
from rig.epipolar.search.halves import HALVES, assign_halves
from rig.epipolar.search.window import Cameras

Map = NDArray[np.float32]

_STRIDE_PX, _RADIUS = 2, 4
"""Every second pixel; patches of 17 x 17 px."""
_ODDS = 4.0
"""Logarithm of the likelihood ratio below which both slopes stand."""
_LIMIT = np.float32(9.0)
"""Squared difference over its variance that counts as a full mismatch."""


def contested(
    splines: Map,
    slope_px: Map,
    rival_px: Map,
    cameras: Cameras,
    scales: Scales,
    grey: Map,
    drift: Map | None = None,
) -> NDArray[np.bool_]:
    """Pixels whose rival fits as well within the noise, (H, W).

    Args:
        splines: what `rig.epipolar.sampling.pad` makes of the equalised views.
        slope_px: (H, W) slopes found.
        rival_px: (H, W) second slopes, NaN for none.
        cameras: where the views stand.
        scales: grey scales of the images.
        grey: (H, W) reference view.
        drift: (2, H, W) light that changes with the view, see `rig.epipolar.drift`; None for none.
    """
    shape = (slope_px.shape[0], slope_px.shape[1])
    there = np.isfinite(rival_px[::_STRIDE_PX, ::_STRIDE_PX])
    if not there.any():
        return np.zeros(shape, np.bool_)
    rows, columns = (_STRIDE_PX * places for places in np.nonzero(there))
    v, u = rows.astype(np.float32), columns.astype(np.float32)
    own, other = slope_px[rows, columns], rival_px[rows, columns]
    variance = _variance(grey, scales, rows, columns)
    light = None if drift is None else drift[:, rows, columns]
    gap = np.zeros(there.shape, np.float32)
    poor = _badness(splines, shape, cameras, (u, v), np.stack([other, own]), variance, light)
    gap[there] = poor[0] - poor[1]
    patch = (2 * _RADIUS + 1) ** 2
    # Each pixel counts for the four that it stands for, and half a square is its logarithm.
    ratio = np.float32(0.5 * patch * _STRIDE_PX**2) * mean(gap, _RADIUS)
    doubtful = ((ratio < np.float32(_ODDS)) & there).astype(np.uint8)
    grown = cv2.resize(doubtful, (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST)
    return grown.astype(np.bool_)


def _variance(
    grey: Map, scales: Scales, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> Map:
    """Of the difference of two views that show the same, at pixels (N,).

    What lines miss each other by counts where the grey value is steep: a plain wall has only noise.
    """
    down_by, across_by = (
        [_mirrored(places + step, side) for step in (-1, 0, 1)]
        for places, side in zip((rows, columns), grey.shape, strict=True)
    )
    around = [[grey[y, x] for x in across_by] for y in down_by]
    (a, b, c), (d, _, e), (f, g, h) = around
    two, eighth = np.float32(2), np.float32(0.125)  # Sobel's derivatives, per px
    along = eighth * ((c - a) + two * (e - d) + (h - f))
    down = eighth * ((f - a) + two * (g - b) + (h - c))
    miss_px = np.float32(np.hypot(scales.start_error_px, scales.misfit_px))
    return np.float32(2.0 * scales.noise**2) + np.square(miss_px) * (along**2 + down**2)


def _mirrored(places: NDArray[np.int64], side: int) -> NDArray[np.int64]:
    """Places (N,) of an axis, those just outside of it mirrored about its outermost pixels."""
    inside = np.abs(places)
    return np.maximum(side - 1 - np.abs(side - 1 - inside), 0)


def _badness(
    splines: Map,
    shape: tuple[int, int],
    cameras: Cameras,
    pixels: tuple[Map, Map],
    slopes_px: Map,
    variance: Map,
    light: Map | None,
) -> Map:
    """Sum over the axes of what the better half differs by, squared over its variance, (K, N).

    Args:
        splines: what `rig.epipolar.sampling.pad` makes of the equalised views.
        shape: height and width of the views, px.
        cameras: where the views stand.
        pixels: columns and rows (N,) of the reference view.
        slopes_px: (K, N) each of the slopes to try.
        variance: (N,) of a difference.
        light: (2, N) light that changes with the view; None for none.
    """
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    columns, rows = (np.tile(places, len(slopes_px)) for places in pixels)
    grey, _, seen = sample_tilts(
        splines, shape, cameras.x_steps, cameras.y_steps, columns, rows, slopes_px.ravel()
    )
    grey, seen = (of.reshape(len(of), *slopes_px.shape) for of in (grey, seen))
    total, count = np.zeros((2, HALVES, *slopes_px.shape), np.float32)
    for i in np.flatnonzero(half >= 0):
        d = grey[i] - grey[cameras.reference]
        if light is not None:
            x, y = np.float32(cameras.x_steps[i]), np.float32(cameras.y_steps[i])
            d -= x * light[0] + y * light[1]
        total[half[i]] += np.where(seen[i], np.minimum(d * d / variance, _LIMIT), 0)
        count[half[i]] += seen[i]
    share = np.where(count > 0, total, np.float32(np.inf))
    best = share.reshape(2, 2, *slopes_px.shape).min(axis=1)
    return np.where(np.isfinite(best), best, np.float32(0)).sum(axis=0).astype(np.float32)
