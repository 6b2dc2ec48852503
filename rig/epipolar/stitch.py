"""Locally linear vector stitching (LLVS): joins the lines of neighbouring pixels.

Every pixel's line optimum is a vector (slope, grey value) with a precision. Where neighbours agree
in both, their slopes lie on one local plane m = a + b dx + c dy, fitted by precision-weighted least
squares; evidence along rows and columns is already summed in each precision, so one set of normal
equations fuses both (inverse-variance weighting). The value a at the centre is the answer, and the
inverse of the normal matrix its variance.
"""

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel

_BLOCK = 128
"""Pixels of a row that are summed at a time."""
_SUMS = 11
_W, _WX, _WY, _WSQUARE, _WXY, _WDIFFERENCE, _WM, _WXM, _WYM, _WMM, _GATES = (
    np.uintp(k * _BLOCK) for k in range(_SUMS)
)
"""Where the sums over the neighbours of a block begin, in one array: weights w; first moments by
x and y; second moments xx + yy, xy and xx - yy; the same with the difference m of the neighbour's
line to the slope so far; and the gates alone, without the neighbours' precision."""


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
    is_thin: bool = False,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Fit a local plane of slope around every pixel, or every second one.

    Maps are (H, W), or thin ones (`rig.epipolar.chessboard`), which need an even stride.

    Args:
        slope_px: (H, W) slope so far: what neighbours must agree with.
        line_px: (H, W) line optimum of every pixel.
        information: (H, W) its precision, 1 / (px per view step)^2.
        grey: (H, W) reference view.
        radius_px: radius of the round window.
        stride_px: 1 to take every pixel of it, 2 for every second one (a chess-board), and so on.
        slope_gate_px: difference of slope from which a neighbour does not count (Tukey biweight).
        grey_gate: difference of grey value at which a neighbour counts a quarter.
        is_thin: whether these are thin maps.

    Returns:
        Slope (H, W); its variance (H, W), infinite where no neighbour knows anything; and the
        neighbours' scatter around the plane over what their precision promises (H, W).
    """
    height, width = slope_px.shape
    slope, variance, misfit = (np.empty((height, width), np.float32) for _ in range(3))
    dy, dx = np.mgrid[0 : radius_px + 1, 1 : radius_px + 1]
    taken = (dy**2 + dx**2 <= (radius_px + 0.5) ** 2) & ((dy + dx) % stride_px == 0)
    quarter = np.stack([dy[taken], dx[taken]], axis=1).astype(np.float32)
    # In units of their gates, slopes and grey values need no more scaling.
    slope_unit, grey_unit = np.float32(slope_gate_px), np.float32(grey_gate)
    maps = (
        (slope_px, slope_unit), (grey, grey_unit), (line_px, slope_unit),
        (information, np.float32(1)),
    )  # fmt: skip
    stride = width + 2 * radius_px
    steps = _steps(dy[taken], dx[taken], stride, is_thin=is_thin)
    framed = np.empty((len(maps), height + 2 * radius_px, stride), np.float32)

    def frame(first: int, last: int) -> None:
        for target, (values, unit) in zip(framed[first:last], maps[first:last], strict=True):
            np.divide(values, unit, out=target[radius_px:-radius_px, radius_px:-radius_px])
            target[:radius_px] = target[-radius_px:] = np.float32(0)
            target[:, :radius_px] = target[:, -radius_px:] = np.float32(0)

    def work(first: int, last: int) -> None:
        _stitch(
            framed.reshape(len(maps), -1), stride, quarter, steps, slope_unit, radius_px, first,
            last, slope, variance, misfit,
        )  # fmt: skip

    run_in_bands(frame, len(maps))
    run_in_bands(work, height)
    return slope, variance, misfit


def _steps(
    dy: NDArray[np.int64], dx: NDArray[np.int64], stride: int, *, is_thin: bool
) -> NDArray[np.int64]:
    """Where neighbours lie in a framed map, from even rows and from odd ones, (2, N, 4).

    The four are those at (dx, dy) and opposite, (-dy, dx) and opposite.
    """
    down, right = np.stack([dy, -dy, dx, -dx], axis=1), np.stack([dx, -dx, -dy, dy], axis=1)
    if not is_thin:
        return np.stack([down * stride + right] * 2)
    odd = np.array([0, 1])[:, None, None]
    return down * stride + (right + odd - (odd + down) % 2) // 2


@kernel()
def _stitch(
    framed: NDArray[np.float32],
    stride: int,
    quarter: NDArray[np.float32],
    steps: NDArray[np.int64],
    slope_unit: np.float32,
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
    start_slope, grey, line, information = framed[0], framed[1], framed[2], framed[3]
    for v in range(start, stop):
        for first in range(0, width, _BLOCK):
            count = min(_BLOCK, width - first)
            here = (v + frame) * stride + frame + first
            _begin(here, count, start_slope, line, information, sums)
            for k in range(len(quarter)):
                _add_neighbours(
                    here, count, steps[v % 2, k], start_slope, grey, line, information,
                    quarter[k, 1], quarter[k, 0], sums,
                )  # fmt: skip
            last = first + count
            _solve(
                sums, start_slope[here : here + count], slope_unit, slope[v, first:last],
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
        sums[u + _W] = w
        sums[u + _WM] = w * m
        sums[u + _WMM] = w * m * m
        sums[u + _GATES] = np.float32(1)


@kernel()
def _add_neighbours(
    here: int,
    count: int,
    steps: NDArray[np.int64],
    start_slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    line: NDArray[np.float32],
    information: NDArray[np.float32],
    dx: np.float32,
    dy: np.float32,
    sums: NDArray[np.float32],
) -> None:
    """Add the four neighbours at (dx, dy), (-dy, dx) and opposite: most of their moments agree.

    p and q lie at +-(dx, dy), r and s at +-(-dy, dx), a quarter turn on: xx + yy is the same for
    all four, xy and xx - yy change their sign, so that a sum and a difference of weights serve all
    second moments. The sums lie `_BLOCK` apart in one array: so the compiler sees that they do.
    """
    square, difference, xy = dx * dx + dy * dy, dx * dx - dy * dy, dx * dy
    one = np.float32(1)
    at_p, at_q, at_r, at_s = here + steps[0], here + steps[1], here + steps[2], here + steps[3]
    for i in range(count):
        u, c = np.uintp(i), np.uintp(here + i)
        m0, g0 = start_slope[c], grey[c]
        p, q = np.uintp(at_p + i), np.uintp(at_q + i)
        r, s = np.uintp(at_r + i), np.uintp(at_s + i)
        near_p, like_p = _near(start_slope[p] - m0), _unlike(grey[p] - g0)
        near_q, like_q = _near(start_slope[q] - m0), _unlike(grey[q] - g0)
        near_r, like_r = _near(start_slope[r] - m0), _unlike(grey[r] - g0)
        near_s, like_s = _near(start_slope[s] - m0), _unlike(grey[s] - g0)
        # One division serves two neighbours.
        both_pq, both_rs = one / (like_p * like_q), one / (like_r * like_s)
        gp, gq = near_p * like_q * both_pq, near_q * like_p * both_pq
        gr, gs = near_r * like_s * both_rs, near_s * like_r * both_rs
        gp, gq, gr, gs = gp * gp, gq * gq, gr * gr, gs * gs
        wp, wq = gp * information[p], gq * information[q]
        wr, ws = gr * information[r], gs * information[s]
        mp, mq, mr, ms = line[p] - m0, line[q] - m0, line[r] - m0, line[s] - m0
        vp, vq, vr, vs = wp * mp, wq * mq, wr * mr, ws * ms
        along, across = wp + wq, wr + ws
        along_odd, across_odd = wp - wq, wr - ws
        m_odd, n_odd = vp - vq, vr - vs
        total, gap = along + across, along - across
        sums[u + _W] += total
        k = u + _WX
        sums[k] = sums[k] + dx * along_odd - dy * across_odd
        k = u + _WY
        sums[k] = sums[k] + dy * along_odd + dx * across_odd
        sums[u + _WSQUARE] += square * total
        sums[u + _WXY] += xy * gap
        sums[u + _WDIFFERENCE] += difference * gap
        sums[u + _WM] += (vp + vq) + (vr + vs)
        k = u + _WXM
        sums[k] = sums[k] + dx * m_odd - dy * n_odd
        k = u + _WYM
        sums[k] = sums[k] + dy * m_odd + dx * n_odd
        k = u + _WMM
        sums[k] = sums[k] + vp * mp + vq * mq + vr * mr + vs * ms
        sums[u + _GATES] += (gp + gq) + (gr + gs)


@kernel()
def _near(slope_difference: np.float32) -> np.float32:
    """Root of Tukey's biweight."""
    return max(np.float32(1) - slope_difference * slope_difference, np.float32(0))


@kernel()
def _unlike(grey_difference: np.float32) -> np.float32:
    """Reciprocal root of a squared Cauchy weight."""
    return np.float32(1) + grey_difference * grey_difference


@kernel()
def _solve(
    sums: NDArray[np.float32],
    start_slope: NDArray[np.float32],
    slope_unit: np.float32,
    slope: NDArray[np.float32],
    variance: NDArray[np.float32],
    misfit: NDArray[np.float32],
) -> None:
    """Eliminate the two tilts from the 3 x 3 normal equations, then the value at the centre.

    [s sx sy; sx xx xy; sy xy yy] [a b c] = [sm xm ym]; `info` is what is left of s, the inverse
    variance of a, once the tilts b and c are unknown as well.
    """
    half, one = np.float32(0.5), np.float32(1)
    for i in range(len(start_slope)):
        u = np.uintp(i)
        s, sx, sy = sums[u + _W], sums[u + _WX], sums[u + _WY]
        square, xy, difference = sums[u + _WSQUARE], sums[u + _WXY], sums[u + _WDIFFERENCE]
        xx, yy = half * (square + difference), half * (square - difference)
        sm, xm, ym = sums[u + _WM], sums[u + _WXM], sums[u + _WYM]
        det = xx * yy - xy * xy
        kx = (sx * yy - sy * xy) / det
        ky = (sy * xx - sx * xy) / det
        info = s - kx * sx - ky * sy
        a = (sm - kx * xm - ky * ym) / info
        b = (yy * (xm - sx * a) - xy * (ym - sy * a)) / det
        c = (xx * (ym - sy * a) - xy * (xm - sx * a)) / det
        rest = sums[u + _WMM] - a * sm - b * xm - c * ym
        known = (s > np.float32(1e-9)) & (det > 0) & (info > np.float32(1e-9))
        scatter = slope_unit * slope_unit * max(rest, np.float32(0)) / sums[u + _GATES]
        slope[u] = slope_unit * (start_slope[u] + (a if known else np.float32(0)))
        variance[u] = one / info if known else np.float32(np.inf)
        misfit[u] = scatter if known else np.float32(0)
