"""Whether a second, separate slope explains the views nearly as well: stripes, repetition.

The likelihood ratio of the two slopes over a patch (J. Neyman and E. S. Pearson, "On the problem of
the most efficient tests of statistical hypotheses", Phil. Trans. R. Soc. A 231, 1933), each by the
views of the better half of every axis, so that a hidden half does not decide.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.rank import mean
from rig.epipolar.sampling import sample_points
from rig.epipolar.scales import Scales
from rig.epipolar.search.halves import HALVES, assign_halves
from rig.epipolar.search.window import Cameras

Map = NDArray[np.float32]

_STRIDE_PX, _RADIUS = 2, 4
"""Every second pixel; patches of 17 x 17 px."""
_ODDS = 4.0
"""Logarithm of the likelihood ratio below which both slopes stand."""
_FEW = 2048
"""Pixels that are compared in less time than a thread needs to wake up."""
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
    light = np.empty((2, 0), np.float32) if drift is None else drift[:, rows, columns]
    poor = _badness(
        splines, shape, cameras, (u, v), (other, own), (grey[rows, columns], variance), light
    )
    gap = np.zeros(there.shape, np.float32)
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
    slopes_px: tuple[Map, Map],
    expected: tuple[Map, Map],
    light: Map,
) -> Map:
    """Sum over the axes of what the better half differs by, squared over its variance, (2, N).

    Args:
        splines: what `rig.epipolar.sampling.pad` makes of the equalised views.
        shape: height and width of the views, px.
        cameras: where the views stand.
        pixels: columns and rows (N,) of the reference view.
        slopes_px: each of the slopes (N,) to try.
        expected: grey values (N,) of these pixels, and the variance of a difference.
        light: (2, N) light that changes with the view; (2, 0) for none.
    """
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    xs, ys = cameras.x_steps.astype(np.float32), cameras.y_steps.astype(np.float32)
    count = len(pixels[0])
    poor = np.empty((2, count), np.float32)

    def work(start: int, stop: int) -> None:
        part = slice(start, stop)
        for slope_px, out in zip(slopes_px, poor, strict=True):
            _add_up(
                splines, *shape, xs, ys, half, pixels[0][part], pixels[1][part], slope_px[part],
                expected[0][part], expected[1][part], np.ascontiguousarray(light[:, part]),
                out[part],
            )  # fmt: skip

    if count < _FEW:
        work(0, count)
    else:
        run_in_bands(work, count)
    return poor


@kernel()
def _add_up(
    padded: NDArray[np.float32],
    height: int,
    width: int,
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    columns: NDArray[np.float32],
    rows: NDArray[np.float32],
    slope: NDArray[np.float32],
    centre: NDArray[np.float32],
    variance: NDArray[np.float32],
    light: NDArray[np.float32],
    poor: NDArray[np.float32],
) -> None:
    """Fill in what the better half of every axis differs by at some pixels (N,)."""
    points, infinite = len(slope), np.float32(np.inf)
    value, tilt, seen = (
        np.empty(points, np.float32),
        np.empty(points, np.float32),
        np.empty(points, np.float32),
    )
    total, count = np.zeros((HALVES, points), np.float32), np.zeros((HALVES, points), np.float32)
    for i in range(len(half)):
        if half[i] < 0:
            continue
        sample_points(
            padded[i], height, width, columns, rows, slope, x_steps[i], y_steps[i], value, tilt,
            seen,
        )  # fmt: skip
        sums, members = total[half[i]], count[half[i]]
        for k in range(points):
            d = value[k] - centre[k]
            if light.shape[1] > 0:
                d -= x_steps[i] * light[0, k] + y_steps[i] * light[1, k]
            sums[k] += seen[k] * min(d * d / variance[k], _LIMIT)
            members[k] += seen[k]
    for k in range(points):
        poor[k] = np.float32(0)
        for axis in range(2):
            best = infinite
            for h in (2 * axis, 2 * axis + 1):
                if count[h, k] > 0:
                    best = min(best, total[h, k])
            poor[k] += best if best < infinite else np.float32(0)
