"""Whether a second, separate slope explains the views nearly as well: stripes, repetition.

The likelihood ratio of the two slopes over a patch (J. Neyman and E. S. Pearson, "On the problem of
the most efficient tests of statistical hypotheses", Phil. Trans. R. Soc. A 231, 1933), each by the
views of the better half of every axis, so that a hidden half does not decide.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
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
    gap[there] = _badness(splines, shape, cameras, u, v, other, variance, light)
    gap[there] -= _badness(splines, shape, cameras, u, v, own, variance, light)
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
    framed = cv2.copyMakeBorder(grey, 1, 1, 1, 1, cv2.BORDER_REFLECT_101)
    around = [[framed[rows + y, columns + x] for x in range(3)] for y in range(3)]
    (a, b, c), (d, _, e), (f, g, h) = around
    two, eighth = np.float32(2), np.float32(0.125)  # Sobel's derivatives, per px
    along = eighth * ((c - a) + two * (e - d) + (h - f))
    down = eighth * ((f - a) + two * (g - b) + (h - c))
    miss_px = np.float32(np.hypot(scales.start_error_px, scales.misfit_px))
    return np.float32(2.0 * scales.noise**2) + np.square(miss_px) * (along**2 + down**2)


def _badness(
    splines: Map,
    shape: tuple[int, int],
    cameras: Cameras,
    columns: Map,
    rows: Map,
    slope_px: Map,
    variance: Map,
    light: Map | None,
) -> Map:
    """Sum over the axes of what the better half differs by, squared over its variance, (N,)."""
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    grey, _, seen = sample_tilts(
        splines, shape, cameras.x_steps, cameras.y_steps, columns, rows, slope_px
    )
    total = np.zeros((HALVES, len(rows)), np.float32)
    count = np.zeros((HALVES, len(rows)), np.float32)
    centre = grey[cameras.reference]
    if light is not None:
        for i in range(len(grey)):
            x, y = np.float32(cameras.x_steps[i]), np.float32(cameras.y_steps[i])
            grey[i] -= x * light[0] + y * light[1]

    def work(start: int, stop: int) -> None:
        for h in range(start, stop):
            for i in np.flatnonzero(half == h):
                d = grey[i] - centre
                total[h] += np.where(seen[i], np.minimum(d * d / variance, _LIMIT), 0)
                count[h] += seen[i]

    run_in_bands(work, HALVES)
    share = np.where(count > 0, total, np.float32(np.inf)).reshape(2, 2, -1).min(axis=1)
    known = np.isfinite(share)
    return np.where(known, share, np.float32(0)).sum(axis=0).astype(np.float32)
