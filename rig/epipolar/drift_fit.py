"""Fits how the grey value of a point drifts with the place of the view, window by window.

Along its line a point shows the views its grey value, plus the drift times their distance, less its
grey slope times the error of its slope. One drift and one such error are shared by a window, so
that texture, whose grey slopes differ, tells them apart: least squares in windows as in B. D. Lucas
and T. Kanade, "An iterative image registration technique with an application to stereo vision"
(IJCAI 1981), with light that changes as in G. D. Hager and P. N. Belhumeur, "Efficient region
tracking with parametric models of geometry and illumination" (IEEE TPAMI 20(10), 1998).
"""

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.rank import quantile
from rig.epipolar.sampling import sample_points
from rig.epipolar.search.window import Cameras

_SUMS, _SPREADS = 9, 6
_XX, _XY, _YY, _XJ, _YJ, _XG, _YG, _JJ, _JG = range(_SUMS)
"""The sums over the views of a point, by index: each with the weight w of the view; x and y its
place in view steps, j its tilt (grey per px per step), g its grey difference to the reference."""
_XG_XG, _XG_XX, _XX_XX, _YG_YG, _YG_YY, _YY_YY = range(_SUMS, _SUMS + _SPREADS)
"""Products of those of one point: summed over a window they tell how its points scatter."""
_TOGETHER = np.float32(5.0)
"""Neighbouring points whose grey values vary as one: what they say counts once."""
_SHARE, _CHI_SQUARE = 0.9, 2.71
"""Quantile of chi square with one degree of freedom: single windows that match wrongly seem to
drift a lot, and would make most of a mean."""
_CLEARLY = 2.0
"""That quantile over what chance has from which a drift is believed: 0.3-1.4 without, 12-28 with
it."""
_HALVINGS = 20
_NO_SLOPE = np.float32(1e6)
"""Slope of what lies outside the picture: like no slope inside."""


def fit_drift(
    splines: NDArray[np.float32],
    grey: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    before: NDArray[np.float32] | None,
    cameras: Cameras,
    *,
    stride_px: int,
    radius: int,
    gate_px: float,
    doubt_levels: float,
    least_tilt_levels: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """Fit the drift of the points of a grid.

    What the windows of a picture find is held back by how much chance alone would let them find:
    the empirical Bayes estimate of W. James and C. Stein, "Estimation with quadratic loss" (4th
    Berkeley Symposium, 1961), where the expected size is the one that makes the sum of chance and
    drift fit what is found, as in R. C. Paule and J. Mandel, "Consensus values and weighting
    factors" (J. Res. Natl. Bur. Stand. 87, 1982).

    Args:
        splines: what `rig.epipolar.sampling.pad` makes of the equalised views.
        grey: (H, W) reference view.
        slope_px: (H, W) slopes so far, px per view step.
        before: (2, H, W) drift so far; None for none.
        cameras: where the views stand.
        stride_px: distance of the points of the grid.
        radius: radius of the round window, points of the grid.
        gate_px: difference of slope from which a neighbour does not count (Tukey biweight).
        doubt_levels: grey difference beyond which a view is doubted (Cauchy scale).
        least_tilt_levels: grey slope along the line that a window must have to tell the error of
            its slope, grey per (px per view step).

    Returns:
        Drift along the row and along the column, grey per view step, and its variance, (2, h, w)
        each, at every `stride_px`-th pixel from `stride_px // 2` on; None where there is none but
        by chance.
    """
    thin = slice(stride_px // 2, None, stride_px)
    slope, centre = (np.ascontiguousarray(each[thin, thin]) for each in (slope_px, grey))
    height, width = slope.shape
    start = np.zeros((2, height, width), np.float32)
    if before is not None:
        start[:] = before[:, thin, thin]
    rows, columns = (np.arange(side, dtype=np.float32)[thin] for side in slope_px.shape)
    framed = np.zeros((_SUMS + _SPREADS, height + 2 * radius, width + 2 * radius), np.float32)
    slopes = np.pad(slope, radius, constant_values=_NO_SLOPE)
    dy, dx = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    square = dx**2 + dy**2
    inside = square <= (radius + 0.5) ** 2
    taps = np.stack([dy[inside], dx[inside]], axis=1)
    nearness = (1 - square[inside] / (radius + 1) ** 2).astype(np.float32)
    xs, ys = cameras.x_steps.astype(np.float32), cameras.y_steps.astype(np.float32)
    drift, variance = np.empty((2, 2, height, width), np.float32)

    def look(first: int, last: int) -> None:
        _look(
            splines, slope_px.shape[0], slope_px.shape[1], centre, slope, start, xs, ys,
            cameras.reference, rows, columns, np.float32(1 / doubt_levels), radius, first, last,
            framed,
        )  # fmt: skip

    def solve(first: int, last: int) -> None:
        _solve(
            framed, slopes, taps, nearness, radius, np.float32(1 / gate_px),
            np.float32(least_tilt_levels**2), first, last, drift, variance,
        )  # fmt: skip

    run_in_bands(look, height)
    run_in_bands(solve, height)
    return (drift, variance) if _hold_back(drift, variance) else None


def _hold_back(drift: NDArray[np.float32], variance: NDArray[np.float32]) -> bool:
    """Shrink each axis of a drift and its variance in place; tell whether anything is left."""
    is_there = False
    for found, chance in zip(drift, variance, strict=True):
        there = np.float32(_expected_variance(found * found, chance))
        share = there / np.maximum(there + chance, np.float32(1e-12))
        found *= share
        chance *= share
        is_there |= bool(there > 0)
    return is_there


def _expected_variance(square: NDArray[np.float32], chance: NDArray[np.float32]) -> float:
    """Variance of a drift of which squares (h, w) are found, each with an error by chance."""
    tiny = np.float32(1e-12)
    if quantile((square / (chance + tiny)).ravel(), _SHARE) <= _CLEARLY * _CHI_SQUARE:
        return 0.0
    low, high = 0.0, float(square.max())
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        expected = chance + np.float32(middle) + tiny
        is_small = quantile((square / expected).ravel(), _SHARE) > _CHI_SQUARE
        low, high = (middle, high) if is_small else (low, middle)
    return 0.5 * (low + high)


def drift_of_all(drift: NDArray[np.float32] | None) -> NDArray[np.float32]:
    """Return a drift as kernels take it: an empty array for none."""
    return np.empty((2, 0, 0), np.float32) if drift is None else drift


@kernel()
def light_of(
    grey: NDArray[np.float32],
    drift: NDArray[np.float32],
    v: int,
    x_step: np.float32,
    y_step: np.float32,
    lit: NDArray[np.float32],
) -> None:
    """Fill in what a view shows of row v of the reference, both (W,); `drift` may be empty."""
    if drift.shape[1] == 0:  # nothing drifts
        lit[:] = grey
    else:
        along, down = drift[0, v], drift[1, v]
        for u in range(len(grey)):
            lit[u] = grey[u] + x_step * along[u] + y_step * down[u]


@kernel()
def _look(
    splines: NDArray[np.float32],
    full_height: int,
    full_width: int,
    centre: NDArray[np.float32],
    slope: NDArray[np.float32],
    start: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    reference: int,
    rows: NDArray[np.float32],
    columns: NDArray[np.float32],
    per_doubt: np.float32,
    frame: int,
    first: int,
    last: int,
    framed: NDArray[np.float32],
) -> None:
    """Sum over the views what each point of the grid says of drift and slope.

    The normal equations of g_i = p x_i + q y_i - e j_i, with the drift p along the row, q down the
    column, and the error e of the slope.
    """
    width = len(columns)
    here, grey, tilt, seen, lit = (
        np.empty(width, np.float32),
        np.empty(width, np.float32),
        np.empty(width, np.float32),
        np.empty(width, np.float32),
        np.empty(width, np.float32),
    )
    one = np.float32(1)
    for v in range(first, last):
        here[:] = rows[v]
        sums = framed[:, v + frame, frame : frame + width]
        xx, xy, yy, xj, yj = sums[_XX], sums[_XY], sums[_YY], sums[_XJ], sums[_YJ]
        xg, yg, jj, jg = sums[_XG], sums[_YG], sums[_JJ], sums[_JG]
        for i in range(len(splines)):
            if i == reference:
                continue
            x, y = x_steps[i], y_steps[i]
            sample_points(
                splines[i], full_height, full_width, columns, here, slope[v], x, y, grey, tilt, seen
            )
            light_of(centre[v], start, v, x, y, lit)
            for u in range(width):
                left = (grey[u] - lit[u]) * per_doubt
                w = seen[u] / (one + left * left)
                g, j = grey[u] - centre[v, u], tilt[u]
                xx[u] += w * x * x
                xy[u] += w * x * y
                yy[u] += w * y * y
                xj[u] += w * x * j
                yj[u] += w * y * j
                xg[u] += w * x * g
                yg[u] += w * y * g
                jj[u] += w * j * j
                jg[u] += w * j * g
        for u in range(width):
            sums[_XG_XG, u], sums[_XG_XX, u] = xg[u] * xg[u], xg[u] * xx[u]
            sums[_XX_XX, u], sums[_YG_YG, u] = xx[u] * xx[u], yg[u] * yg[u]
            sums[_YG_YY, u], sums[_YY_YY, u] = yg[u] * yy[u], yy[u] * yy[u]


@kernel()
def _solve(
    framed: NDArray[np.float32],
    slopes: NDArray[np.float32],
    taps: NDArray[np.int64],
    nearness: NDArray[np.float32],
    frame: int,
    per_gate: np.float32,
    least: np.float32,
    first: int,
    last: int,
    drift: NDArray[np.float32],
    variance: NDArray[np.float32],
) -> None:
    """Sum over each window, eliminate the error of the slope, solve for the drift.

    Every sum of x and y loses its share by way of j, as in xx - xj xj / jj; what is left are two
    equations for p and q. The variance of p is sum (xg - p xx)^2 / xx^2 over the points.
    """
    width = drift.shape[2]
    one, zero, two = np.float32(1), np.float32(0), np.float32(2)
    sums, gate = np.empty((_SUMS + _SPREADS, width), np.float32), np.empty(width, np.float32)
    for v in range(first, last):
        sums[:] = zero
        here = slopes[v + frame, frame : frame + width]
        for k in range(len(taps)):
            row, column = v + frame + taps[k, 0], frame + taps[k, 1]
            there = slopes[row, column : column + width]
            for u in range(width):
                apart = (there[u] - here[u]) * per_gate
                like = max(one - apart * apart, zero)
                gate[u] = like * like * nearness[k]
            for s in range(_SUMS + _SPREADS):
                if s == _SUMS:  # variances go by squared weights
                    for u in range(width):
                        gate[u] *= gate[u]
                total, point = sums[s], framed[s, row, column : column + width]
                for u in range(width):
                    total[u] += gate[u] * point[u]
        for u in range(width):
            xj, yj, jg, jj = sums[_XJ, u], sums[_YJ, u], sums[_JG, u], sums[_JJ, u] + least
            xx, yy = sums[_XX, u] - xj * xj / jj, sums[_YY, u] - yj * yj / jj
            xy = sums[_XY, u] - xj * yj / jj
            xg, yg = sums[_XG, u] - xj * jg / jj, sums[_YG, u] - yj * jg / jj
            # A tiny share keeps an axis without any views at zero.
            tiny = np.float32(1e-4) * (sums[_XX, u] + sums[_YY, u]) + np.float32(1e-9)
            xx, yy = xx + tiny, yy + tiny
            det = xx * yy - xy * xy
            along, down = (xg * yy - yg * xy) / det, (yg * xx - xg * xy) / det
            drift[0, v, u], drift[1, v, u] = along, down
            apart = (
                sums[_XG_XG, u] - two * along * sums[_XG_XX, u] + along * along * sums[_XX_XX, u]
            )
            variance[0, v, u] = _TOGETHER * max(apart, zero) / (xx * xx)
            apart = sums[_YG_YG, u] - two * down * sums[_YG_YY, u] + down * down * sums[_YY_YY, u]
            variance[1, v, u] = _TOGETHER * max(apart, zero) / (yy * yy)
