"""Locally linear vector stitching (LLVS): joins the lines of neighbouring pixels.

Every pixel's line optimum is a vector (slope, grey value) with a precision. Where neighbours agree
in both, their slopes lie on one local plane m = a + b dx + c dy, fitted by precision-weighted least
squares; evidence along rows and columns is already summed in each precision, so one set of normal
equations fuses both (inverse-variance weighting). The value a at the centre is the answer, and the
inverse of the normal matrix its variance.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.kernel import kernel
from rig.epipolar.rank import highest

_SUMS = 11
_BLOCK = 128
_BEHIND_SHARE = np.float32(0.02)


def behind_jumps(
    slope_px: NDArray[np.float32], information: NDArray[np.float32], jump_px: float
) -> NDArray[np.float32]:
    """Take away most of the information of pixels that touch a nearer surface, (H, W).

    The grey edge of the nearer surface moves with that surface, but its blur reaches into the
    first pixel of the farther one and would tell that pixel the wrong slope with much confidence.
    """
    nearest = highest(slope_px, 1)
    return np.where(nearest > slope_px + jump_px, _BEHIND_SHARE * information, information)


def stitch(
    slope_px: NDArray[np.float32],
    line_px: NDArray[np.float32],
    information: NDArray[np.float32],
    grey: NDArray[np.float32],
    *,
    radius_px: int,
    stride_px: int,
    slope_gate_px: float,
    grey_gate: float,
    ridge: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Fit a local plane of slope around every pixel.

    Args:
        slope_px: (H, W) slope so far: what neighbours must agree with.
        line_px: (H, W) line optimum of every pixel.
        information: (H, W) its precision, any unit.
        grey: (H, W) reference view.
        radius_px: radius of the round window.
        stride_px: 1 to take every pixel of it, 2 for every second one (a chess-board), and so on.
        slope_gate_px: difference of slope from which a neighbour does not count (Tukey biweight).
        grey_gate: difference of grey value at which a neighbour counts a quarter.
        ridge: information that holds the plane's tilt to zero.

    Returns:
        Slope (H, W); variance for unit-variance grey noise (H, W), infinite where no
        neighbour knows anything; and the grey noise power that the neighbours' scatter
        around the plane amounts to (H, W).
    """
    height, width = slope_px.shape
    slope, variance, misfit = (np.empty((height, width), np.float32) for _ in range(3))
    dy, dx = np.mgrid[0 : radius_px + 1, 1 : radius_px + 1]
    taken = (dy**2 + dx**2 <= (radius_px + 0.5) ** 2) & ((dy + dx) % stride_px == 0)
    quarter = np.stack([dy[taken], dx[taken]], axis=1)
    slopes, greys, lines, weights = (
        np.pad(values, radius_px).ravel() for values in (slope_px, grey, line_px, information)
    )

    def work(start: int, stop: int) -> None:
        _stitch(
            slopes, greys, lines, weights, width + 2 * radius_px, quarter,
            np.float32(1 / slope_gate_px), np.float32(1 / grey_gate), np.float32(ridge), radius_px,
            start, stop, slope, variance, misfit,
        )  # fmt: skip

    run_in_bands(work, height)
    return slope, variance, misfit


@kernel()
def _stitch(
    start_slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    line: NDArray[np.float32],
    information: NDArray[np.float32],
    stride: int,
    quarter: NDArray[np.int64],
    per_slope: np.float32,
    per_grey: np.float32,
    ridge: np.float32,
    frame: int,
    start: int,
    stop: int,
    slope: NDArray[np.float32],
    variance: NDArray[np.float32],
    misfit: NDArray[np.float32],
) -> None:
    """Row by row in blocks whose sums stay in the first cache."""
    width = slope.shape[1]
    sums = np.empty(_SUMS * _BLOCK, np.float32)
    for v in range(start, stop):
        for first in range(0, width, _BLOCK):
            count = min(_BLOCK, width - first)
            here = (v + frame) * stride + frame + first
            _begin(here, count, start_slope, line, information, sums)
            for k in range(len(quarter)):
                dy, dx = quarter[k, 0], quarter[k, 1]
                _add_neighbours(
                    here, count, dy * stride + dx, dx * stride - dy, start_slope, grey, line,
                    information, np.float32(dx), np.float32(dy), per_slope, per_grey, sums,
                )  # fmt: skip
            last = first + count
            _solve(
                sums, ridge, start_slope[here : here + count], slope[v, first:last],
                variance[v, first:last], misfit[v, first:last],
            )  # fmt: skip


@kernel()
def _begin(
    here: int,
    count: int,
    start_slope: NDArray[np.float32],
    line: NDArray[np.float32],
    information: NDArray[np.float32],
    sums: NDArray[np.float32],
) -> None:
    """Start the sums with the pixels themselves, at distance 0."""
    sums[:] = np.float32(0)
    for i in range(count):
        u, c = np.uintp(i), np.uintp(here + i)
        w = information[c]
        m = line[c] - start_slope[c]
        sums[u] = w
        sums[u + np.uintp(6 * _BLOCK)] = w * m
        sums[u + np.uintp(9 * _BLOCK)] = w * m * m
        sums[u + np.uintp(10 * _BLOCK)] = np.float32(1)


@kernel()
def _add_neighbours(
    here: int,
    count: int,
    one_way: int,
    other_way: int,
    start_slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    line: NDArray[np.float32],
    information: NDArray[np.float32],
    dx: np.float32,
    dy: np.float32,
    per_slope: np.float32,
    per_grey: np.float32,
    sums: NDArray[np.float32],
) -> None:
    """Add the four neighbours at (dx, dy), (-dy, dx) and opposite: most of their moments agree.

    The sums lie `_BLOCK` apart in one array, so that the compiler sees that they are apart.
    """
    xx, xy, yy = dx * dx, dx * dy, dy * dy
    for i in range(count):
        u, c = np.uintp(i), np.uintp(here + i)
        m0, g0 = start_slope[c], grey[c]
        p, q = np.uintp(here + i + one_way), np.uintp(here + i - one_way)
        r, s = np.uintp(here + i + other_way), np.uintp(here + i - other_way)
        gp = _gate((start_slope[p] - m0) * per_slope, (grey[p] - g0) * per_grey)
        gq = _gate((start_slope[q] - m0) * per_slope, (grey[q] - g0) * per_grey)
        gr = _gate((start_slope[r] - m0) * per_slope, (grey[r] - g0) * per_grey)
        gs = _gate((start_slope[s] - m0) * per_slope, (grey[s] - g0) * per_grey)
        wp, wq = gp * information[p], gq * information[q]
        wr, ws = gr * information[r], gs * information[s]
        mp, mq, mr, ms = line[p] - m0, line[q] - m0, line[r] - m0, line[s] - m0
        vp, vq, vr, vs = wp * mp, wq * mq, wr * mr, ws * ms
        one, other = wp + wq, wr + ws
        one_odd, other_odd = wp - wq, wr - ws
        m_odd, n_odd = vp - vq, vr - vs
        sums[u] += one + other
        sums[u + np.uintp(_BLOCK)] += dx * one_odd - dy * other_odd
        sums[u + np.uintp(2 * _BLOCK)] += dy * one_odd + dx * other_odd
        sums[u + np.uintp(3 * _BLOCK)] += xx * one + yy * other
        sums[u + np.uintp(4 * _BLOCK)] += xy * (one - other)
        sums[u + np.uintp(5 * _BLOCK)] += yy * one + xx * other
        sums[u + np.uintp(6 * _BLOCK)] += (vp + vq) + (vr + vs)
        sums[u + np.uintp(7 * _BLOCK)] += dx * m_odd - dy * n_odd
        sums[u + np.uintp(8 * _BLOCK)] += dy * m_odd + dx * n_odd
        sums[u + np.uintp(9 * _BLOCK)] += (vp * mp + vq * mq) + (vr * mr + vs * ms)
        sums[u + np.uintp(10 * _BLOCK)] += (gp + gq) + (gr + gs)


@kernel()
def _gate(slope_difference: np.float32, grey_difference: np.float32) -> np.float32:
    """Tukey's biweight of the one, a squared Cauchy weight of the other."""
    one = np.float32(1)
    near = max(one - slope_difference * slope_difference, np.float32(0))
    like = one + grey_difference * grey_difference
    share = near / like
    return share * share


@kernel()
def _solve(
    sums: NDArray[np.float32],
    ridge: np.float32,
    start_slope: NDArray[np.float32],
    slope: NDArray[np.float32],
    variance: NDArray[np.float32],
    misfit: NDArray[np.float32],
) -> None:
    """Eliminate the two tilts from the 3 x 3 normal equations, then the value at the centre."""
    for u in range(len(start_slope)):
        s, sx, sy = sums[u], sums[u + 1 * _BLOCK], sums[u + 2 * _BLOCK]
        xx = sums[u + 3 * _BLOCK] + ridge
        xy = sums[u + 4 * _BLOCK]
        yy = sums[u + 5 * _BLOCK] + ridge
        sm, xm, ym = sums[u + 6 * _BLOCK], sums[u + 7 * _BLOCK], sums[u + 8 * _BLOCK]
        det = xx * yy - xy * xy
        if s > np.float32(1e-9) and det > 0:
            kx = (sx * yy - sy * xy) / det
            ky = (sy * xx - sx * xy) / det
            info = s - kx * sx - ky * sy
            if info > np.float32(1e-9):
                a = (sm - kx * xm - ky * ym) / info
                b = (yy * (xm - sx * a) - xy * (ym - sy * a)) / det
                c = (xx * (ym - sy * a) - xy * (xm - sx * a)) / det
                slope[u] = start_slope[u] + a
                variance[u] = np.float32(1) / info
                rest = sums[u + 9 * _BLOCK] - a * sm - b * xm - c * ym
                misfit[u] = rest / sums[u + 10 * _BLOCK] if rest > 0 else np.float32(0)
                continue
        slope[u] = start_slope[u]
        variance[u] = np.float32(np.inf)
        misfit[u] = np.float32(0)
