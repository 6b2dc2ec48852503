"""One Gauss-Newton step of the epipolar line through every pixel.

Along the line of a reference pixel all views show one unknown grey value, so the slope and that
value are fitted together: a mean-centred least-squares problem with Cauchy weights (Holland and
Welsch, "Robust regression using iteratively reweighted least-squares", 1977). Views are sampled
with Catmull-Rom splines (Catmull and Rom, 1974). A half that does not see the point is left out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.halves import HALVES, assign_halves
from rig.epipolar.kernel import kernel
from rig.epipolar.sampling import pad, sample_points

MISFIT_LIMIT = 3.0
SEEN, HALF_HIDDEN, UNSEEN = 0, 1, 2
"""All halves see the point; one half of an axis does not; it falls outside all other views."""


@dataclass(frozen=True, slots=True)
class LineFits:
    """The optimum of every pixel's own epipolar line."""

    slope_px: NDArray[np.float32]
    """(H, W)."""
    information: NDArray[np.float32]
    """(H, W) weighted sum of squared mean-centred grey slopes, (grey / (px per step))^2."""
    misfit: NDArray[np.float32]
    """(H, W) mean grey difference to the reference over the halves that see the point, in Cauchy
    scales, each view counted as `MISFIT_LIMIT` at most."""
    sight: NDArray[np.uint8]
    """(H, W) `SEEN`, `HALF_HIDDEN` or `UNSEEN`."""


def fit_lines(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    slope_px: NDArray[np.float32],
    scale: float,
    reach_px: float,
) -> LineFits:
    """Improve every pixel's slope by one step.

    Args:
        images: (V, H, W) equalised grey values.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        reference: index of the reference view.
        slope_px: (H, W) start, px per view step.
        scale: grey difference beyond which a view is doubted (Cauchy scale).
        reach_px: largest step that the linearisation can be trusted for, px per view step.
    """
    height, width = slope_px.shape
    height, width = slope_px.shape
    views = len(images)
    padded = pad(images)
    half = assign_halves(x_steps, y_steps)
    xs, ys = x_steps.astype(np.float32), y_steps.astype(np.float32)
    slope = np.empty((height, width), np.float32)
    information, misfit = (np.empty((height, width), np.float32) for _ in range(2))
    sight = np.empty((height, width), np.uint8)

    def work(start: int, stop: int) -> None:
        rows = np.empty((3, views, width), np.float32)
        sums = np.empty((10, width), np.float32)
        sums[8] = np.arange(width)
        _fit_lines(
            padded, xs, ys, half, reference, slope_px, np.float32(1 / scale), np.float32(reach_px),
            start, stop, rows, sums, slope, information, misfit, sight,
        )  # fmt: skip

    run_in_bands(work, height)
    return LineFits(slope, information, misfit, sight)


@kernel()
def _fit_lines(
    padded: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    reference: int,
    start_slope: NDArray[np.float32],
    per_scale: np.float32,
    reach: np.float32,
    start: int,
    stop: int,
    rows: NDArray[np.float32],
    sums: NDArray[np.float32],
    slope: NDArray[np.float32],
    information: NDArray[np.float32],
    misfit: NDArray[np.float32],
    sight: NDArray[np.uint8],
) -> None:
    """Row by row: sample all views, drop hidden halves, sum the normal equations, solve."""
    grey, tilt, seen = rows[0], rows[1], rows[2]
    columns, here = sums[8], sums[9]
    height, width = start_slope.shape
    for v in range(start, stop):
        for u in range(width):
            here[u] = np.float32(v)
        for i in range(len(padded)):
            sample_points(
                padded[i], height, width, columns, here, start_slope[v], x_steps[i], y_steps[i],
                grey[i], tilt[i], seen[i],
            )  # fmt: skip
        centre = grey[reference]
        for i in range(len(padded)):
            if i != reference:
                row = grey[i]
                for u in range(width):
                    row[u] -= centre[u]
        for u in range(width):
            centre[u] = np.float32(0)
        _leave_out_hidden(grey, half, per_scale, seen, sums, misfit[v], sight[v])
        _sum_up(grey, tilt, seen, per_scale, sums)
        _step(sums, reach, start_slope[v], slope[v], information[v])


@kernel()
def _leave_out_hidden(
    grey: NDArray[np.float32],
    half: NDArray[np.int32],
    per_scale: np.float32,
    seen: NDArray[np.float32],
    sums: NDArray[np.float32],
    mean: NDArray[np.float32],
    sight: NDArray[np.uint8],
) -> None:
    """Unmark the half of an axis that fits much worse than the other."""
    for h in range(HALVES):
        _misfit(grey, half, h, per_scale, seen, sums[2 * h], sums[2 * h + 1])
    for u in range(grey.shape[1]):
        any_view = sums[1, u] + sums[3, u] + sums[5, u] + sums[7, u]
        sight[u] = SEEN if any_view > 0 else UNSEEN
        total = np.float32(0)
        count = np.float32(0)
        for h in range(HALVES):
            misfit, members = sums[2 * h, u], sums[2 * h + 1, u]
            other_misfit, others = sums[2 * (h ^ 1), u], sums[2 * (h ^ 1) + 1, u]
            worse = misfit * others > np.float32(2.5) * other_misfit * members
            if worse and misfit > members:
                sight[u] = HALF_HIDDEN
                for i in range(len(half)):
                    seen[i, u] *= np.float32(half[i] != h)
            else:
                total += misfit
                count += members
        mean[u] = total / max(count, np.float32(1))


@kernel()
def _misfit(
    grey: NDArray[np.float32],
    half: NDArray[np.int32],
    which: int,
    per_scale: np.float32,
    seen: NDArray[np.float32],
    misfit: NDArray[np.float32],
    members: NDArray[np.float32],
) -> None:
    """Sum of the truncated differences to the reference over the views of one half."""
    limit = np.float32(MISFIT_LIMIT)
    for u in range(len(misfit)):
        misfit[u] = np.float32(0)
        members[u] = np.float32(0)
    for i in range(len(half)):
        if half[i] == which:
            g, s = grey[i], seen[i]
            for u in range(len(misfit)):
                misfit[u] += s[u] * min(abs(g[u]) * per_scale, limit)
                members[u] += s[u]


@kernel()
def _sum_up(
    grey: NDArray[np.float32],
    tilt: NDArray[np.float32],
    seen: NDArray[np.float32],
    per_scale: np.float32,
    sums: NDArray[np.float32],
) -> None:
    """Weighted sums of 1, j, g, jj, jg over the views (j tilt, g grey difference)."""
    views, width = grey.shape
    sw, swj, swg, swjj, swjg = sums[0], sums[1], sums[2], sums[3], sums[4]
    for u in range(width):
        sw[u] = swj[u] = swg[u] = swjj[u] = swjg[u] = np.float32(0)
    for i in range(views):
        gs, js, s = grey[i], tilt[i], seen[i]
        for u in range(width):
            g, j = gs[u], js[u]
            t = g * per_scale
            w = s[u] / (np.float32(1) + t * t)
            wj = w * j
            sw[u] += w
            swj[u] += wj
            swg[u] += w * g
            swjj[u] += wj * j
            swjg[u] += wj * g


@kernel()
def _step(
    sums: NDArray[np.float32],
    reach: np.float32,
    start_slope: NDArray[np.float32],
    slope: NDArray[np.float32],
    information: NDArray[np.float32],
) -> None:
    """Solve for slope and grey value; the grey value is eliminated (mean-centred sums)."""
    for u in range(len(slope)):
        sw, swj, swg = sums[0, u], sums[1, u], sums[2, u]
        info = sums[3, u] - swj * swj / sw
        cross = sums[4, u] - swj * swg / sw
        known = info > np.float32(1e-12)
        info = info if known else np.float32(0)
        move = max(min(-cross / info, reach), -reach) if known else np.float32(0)
        slope[u] = start_slope[u] + move
        information[u] = info
