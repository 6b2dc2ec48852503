"""One Gauss-Newton step of the epipolar line through every pixel.

Along the line of a reference pixel all views show one unknown grey value, so the slope and that
value are fitted together: a mean-centred least-squares problem with Cauchy weights (Holland and
Welsch, "Robust regression using iteratively reweighted least-squares", 1977). A view that a nearer
surface covers hardly counts, and a half that does not see the point is left out.

Between pixels a sample averages more noise away than on a pixel, which draws lines there: the bias
of Rohde, Aldroubi and Healy, "Interpolation artifacts in sub-pixel image registration" (IEEE Trans.
Image Processing 18, 2009). Its expected value is taken off.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands, run_side_by_side
from rig.compute.kernel import kernel
from rig.epipolar.chessboard import mean_around, thinned
from rig.epipolar.drift_fit import drift_of_all, light_of
from rig.epipolar.normal_equations import SUMS, WW, W, add_view, lock, step
from rig.epipolar.rank import mean
from rig.epipolar.sampling import pad, sample_points
from rig.epipolar.search.halves import ABOVE, BELOW, HALVES, LEFT, RIGHT, assign_halves

MISFIT_LIMIT = 3.0
_MAPS = 6
_SLOPE, _INFORMATION, _SIGNAL, _MISFIT, _SCATTER, _FREEDOM = range(_MAPS)
"""What the kernel fills in, in the order of `LineFits`."""
_COVERED_SHARE = np.float32(0.01)
"""Weight of a view whose place is covered: it decides where no other view sees the point."""
SEEN, HALF_HIDDEN, UNSEEN = 0, 1, 2
"""All halves see the point; one half of an axis does not; it falls outside all other views."""


@dataclass(frozen=True, slots=True)
class LineFits:
    """The optimum of every pixel's own epipolar line, or of every second one's.

    Maps are (H, W), or thin ones (`rig.epipolar.chessboard`).
    """

    slope_px: NDArray[np.float32]
    """(H, W)."""
    information: NDArray[np.float32]
    """(H, W) weighted sum of squared mean-centred grey slopes, (grey / (px per step))^2."""
    signal: NDArray[np.float32]
    """(H, W) the information without what grey noise alone would seem to tell."""
    misfit: NDArray[np.float32]
    """(H, W) mean grey difference to the reference over the halves that see the point, in Cauchy
    scales, each view counted as `MISFIT_LIMIT` at most."""
    scatter: NDArray[np.float32]
    """(H, W) weighted sum of squared grey differences that the line does not explain, grey^2."""
    freedom: NDArray[np.float32]
    """(H, W) what the scatter would be if every view's grey noise had a variance of 1."""
    sight: NDArray[np.uint8]
    """(H, W) `SEEN`, `HALF_HIDDEN` or `UNSEEN`."""
    is_thin: bool = False
    """Whether these are thin maps."""

    def around(self, values: NDArray[np.float32], radius_px: int) -> NDArray[np.float32]:
        """Mean of one of these maps over a square window of the picture."""
        return mean_around(values, radius_px) if self.is_thin else mean(values, radius_px)


def fit_lines(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    slope_px: NDArray[np.float32],
    covered: NDArray[np.bool_],
    scale: float,
    derivative_variance: float,
    locking: tuple[float, float, float],
    reach_px: float,
    splines: NDArray[np.float32] | None = None,
    drift: NDArray[np.float32] | None = None,
    *,
    is_thin: bool = False,
) -> LineFits:
    """Improve every pixel's slope by one step.

    Args:
        images: (V, H, W) equalised grey values.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        reference: index of the reference view.
        slope_px: (H, W) start, px per view step.
        covered: (V, H, W) whether a view shows a nearer surface in the place of the point; for
            every second pixel thin maps.
        scale: grey difference beyond which a view is doubted (Cauchy scale).
        derivative_variance: variance that noise alone gives the derivative of the grey value by
            the position, (grey / px)^2.
        locking: its covariance with the grey value itself (`rig.epipolar.noise.local.locking`).
        reach_px: largest step that the linearisation can be trusted for, px per view step.
        splines: what `rig.epipolar.sampling.pad` makes of the images, if there already.
        drift: (2, H, W) light that changes with the view, see `rig.epipolar.drift`; None for none.
        is_thin: whether every second pixel will do.
    """
    grey, wide = images[reference], slope_px.shape[1]
    if is_thin:
        start_px, centre = slope_px, grey
        slope_px, grey = run_side_by_side(lambda: thinned(start_px), lambda: thinned(centre))
        drift = None if drift is None else np.stack([thinned(axis) for axis in drift])
    height, width = slope_px.shape
    padded = pad(images, x_steps, y_steps) if splines is None else splines
    half = assign_halves(x_steps, y_steps)
    xs, ys = x_steps.astype(np.float32), y_steps.astype(np.float32)
    maps = np.empty((_MAPS, height, width), np.float32)
    sight = np.empty((height, width), np.uint8)
    drawn, light = np.array(locking, np.float32), drift_of_all(drift)

    def work(start: int, stop: int) -> None:
        _fit_lines(
            padded, wide, grey, xs, ys, half, slope_px, covered, np.float32(1 / scale),
            np.float32(derivative_variance), drawn, np.float32(reach_px), light, start, stop,
            maps, sight,
        )  # fmt: skip

    run_in_bands(work, height)
    return LineFits(*maps, sight=sight, is_thin=is_thin)


@kernel()
def _fit_lines(
    padded: NDArray[np.float32],
    wide: int,
    centre: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    start_slope: NDArray[np.float32],
    covered: NDArray[np.bool_],
    per_scale: np.float32,
    derivative_variance: np.float32,
    locking: NDArray[np.float32],
    reach: np.float32,
    drift: NDArray[np.float32],
    start: int,
    stop: int,
    maps: NDArray[np.float32],
    sight: NDArray[np.uint8],
) -> None:
    """Row by row: sample all views, drop hidden halves, sum the normal equations, solve.

    Minimises sum_i w_i (g_i + j_i d - a)^2 over the step d of the slope and the grey value a of the
    point, with Cauchy weights w_i = 1 / (1 + (g_i / scale)^2); the reference takes part with w = 1,
    g = j = 0. Fills `maps` (6, H, W) and `sight` (H, W).

    The first axis of every working array is a view, a half or a sum, the last a pixel of the row:
    the inner loops then run over neighbours, and vectorise. Pictures are `wide` px; maps that are
    not are thin ones.
    """
    height, width = start_slope.shape
    views = len(padded)
    grey, tilt, seen = (
        np.empty((views, width), np.float32),
        np.empty((views, width), np.float32),
        np.empty((views, width), np.float32),
    )
    columns, here = np.empty(width, np.float32), np.empty(width, np.float32)
    stride = np.int64(1 if width == wide else 2)
    poor, members = np.empty((HALVES, width), np.float32), np.empty((HALVES, width), np.float32)
    sums = np.empty((SUMS, width), np.float32)
    drawn, lit = np.empty(width, np.float32), np.empty(width, np.float32)
    for v in range(start, stop):
        here[:] = np.float32(v)
        for u in range(width):
            columns[u] = np.float32(min(u * stride + (stride - 1) * (v % 2), wide - 1))
        poor[:] = np.float32(0)
        members[:] = np.float32(0)
        for i in range(views):
            if half[i] >= 0:
                sample_points(
                    padded[i], height, wide, columns, here, start_slope[v], x_steps[i],
                    y_steps[i], grey[i], tilt[i], seen[i],
                )  # fmt: skip
                _doubt(covered[i, v], seen[i])
                light_of(centre[v], drift, v, x_steps[i], y_steps[i], lit)
                _compare(grey[i], lit, seen[i], per_scale, poor[half[i]], members[half[i]])
        sums[:] = np.float32(0)
        sums[W] = sums[WW] = np.float32(1)  # the reference itself: difference and tilt are 0
        _find_hidden(poor, members, maps[_MISFIT, v], sight[v])
        for i in range(views):
            if half[i] >= 0:
                # Variance of the tilt by noise, which is independent along the row and down.
                noise = derivative_variance * (x_steps[i] * x_steps[i] + y_steps[i] * y_steps[i])
                drawn[:] = np.float32(0)
                if x_steps[i] != 0:
                    lock(columns, start_slope[v], x_steps[i], locking, drawn)
                if y_steps[i] != 0:
                    lock(here, start_slope[v], y_steps[i], locking, drawn)
                add_view(grey[i], tilt[i], seen[i], members[half[i]], drawn, per_scale, noise, sums)
        step(
            sums, reach, start_slope[v], maps[_SLOPE, v], maps[_INFORMATION, v], maps[_SIGNAL, v],
            maps[_SCATTER, v], maps[_FREEDOM, v],
        )  # fmt: skip


@kernel()
def _doubt(covered: NDArray[np.bool_], seen: NDArray[np.float32]) -> None:
    """Take away nearly all the weight of a covered view."""
    for u in range(len(seen)):
        seen[u] *= _COVERED_SHARE if covered[u] else np.float32(1)


@kernel()
def _compare(
    grey: NDArray[np.float32],
    centre: NDArray[np.float32],
    seen: NDArray[np.float32],
    per_scale: np.float32,
    poor: NDArray[np.float32],
    members: NDArray[np.float32],
) -> None:
    """Subtract what the view would show; add the view's truncated misfit to that of its half."""
    limit = np.float32(MISFIT_LIMIT)
    for u in range(len(grey)):
        grey[u] -= centre[u]
        poor[u] += seen[u] * min(abs(grey[u]) * per_scale, limit)
        members[u] += seen[u]


@kernel()
def _find_hidden(
    poor: NDArray[np.float32],
    members: NDArray[np.float32],
    mean: NDArray[np.float32],
    sight: NDArray[np.uint8],
) -> None:
    """Empty the half of an axis that fits much worse than the other.

    With poor / members, the mean misfit of a half: it is hidden where that is above 1 (it does not
    fit by itself) and above 2.5 times that of the other half. Multiplied out, so that nothing is
    divided by a half without members. `&` and not `and`: a branch would not vectorise.
    """
    worse = np.float32(2.5)
    one = np.float32(1)
    zero = np.float32(0)
    a, b, c, d = poor[LEFT], poor[RIGHT], poor[ABOVE], poor[BELOW]
    na, nb, nc, nd = members[LEFT], members[RIGHT], members[ABOVE], members[BELOW]
    for u in range(len(mean)):
        any_view = na[u] + nb[u] + nc[u] + nd[u] > zero
        keep_a = zero if (a[u] * nb[u] > worse * b[u] * na[u]) & (a[u] > na[u]) else one
        keep_b = zero if (b[u] * na[u] > worse * a[u] * nb[u]) & (b[u] > nb[u]) else one
        keep_c = zero if (c[u] * nd[u] > worse * d[u] * nc[u]) & (c[u] > nc[u]) else one
        keep_d = zero if (d[u] * nc[u] > worse * c[u] * nd[u]) & (d[u] > nd[u]) else one
        na[u] *= keep_a
        nb[u] *= keep_b
        nc[u] *= keep_c
        nd[u] *= keep_d
        total = keep_a * a[u] + keep_b * b[u] + keep_c * c[u] + keep_d * d[u]
        mean[u] = total / max(na[u] + nb[u] + nc[u] + nd[u], np.float32(1e-6))
        all_kept = keep_a * keep_b * keep_c * keep_d > zero
        sight[u] = UNSEEN if not any_view else SEEN if all_kept else HALF_HIDDEN
