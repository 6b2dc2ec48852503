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
    dy, dx = np.mgrid[-radius_px : radius_px + 1, -radius_px : radius_px + 1]
    taken = (dy**2 + dx**2 <= (radius_px + 0.5) ** 2) & ((dy + dx) % stride_px == 0)
    offsets = np.stack([dy[taken], dx[taken]], axis=1)

    def work(start: int, stop: int) -> None:
        _stitch(
            slope_px, line_px, information, grey, offsets, np.float32(1 / slope_gate_px),
            np.float32(1 / grey_gate), np.float32(ridge), start, stop, slope, variance, misfit,
        )  # fmt: skip

    run_in_bands(work, height)
    return slope, variance, misfit


@kernel()
def _stitch(
    start_slope: NDArray[np.float32],
    line: NDArray[np.float32],
    information: NDArray[np.float32],
    grey: NDArray[np.float32],
    offsets: NDArray[np.int64],
    per_slope: np.float32,
    per_grey: np.float32,
    ridge: np.float32,
    start: int,
    stop: int,
    slope: NDArray[np.float32],
    variance: NDArray[np.float32],
    misfit: NDArray[np.float32],
) -> None:
    height, width = line.shape
    sums = np.empty((_SUMS, width), np.float32)
    for v in range(start, stop):
        sums[:] = np.float32(0)
        for k in range(len(offsets)):
            dy, dx = offsets[k, 0], offsets[k, 1]
            first, last = max(0, -dx), min(width, width - dx)
            if 0 <= v + dy < height and last > first:
                _add_neighbours(
                    start_slope[v, first:last], grey[v, first:last],
                    start_slope[v + dy, first + dx : last + dx],
                    grey[v + dy, first + dx : last + dx], line[v + dy, first + dx : last + dx],
                    information[v + dy, first + dx : last + dx], np.float32(dx), np.float32(dy),
                    per_slope, per_grey, sums[:, first:last],
                )  # fmt: skip
        _solve(sums, ridge, start_slope[v], slope[v], variance[v], misfit[v])


@kernel()
def _add_neighbours(
    start_slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    near_slope: NDArray[np.float32],
    near_grey: NDArray[np.float32],
    line: NDArray[np.float32],
    information: NDArray[np.float32],
    dx: np.float32,
    dy: np.float32,
    per_slope: np.float32,
    per_grey: np.float32,
    sums: NDArray[np.float32],
) -> None:
    one = np.float32(1)
    s0, s1, s2, s3, s4 = sums[0], sums[1], sums[2], sums[3], sums[4]
    s5, s6, s7, s8, s9, s10 = sums[5], sums[6], sums[7], sums[8], sums[9], sums[10]
    for u in range(len(line)):
        a = (near_slope[u] - start_slope[u]) * per_slope
        b = (near_grey[u] - grey[u]) * per_grey
        near = max(one - a * a, np.float32(0))
        like = one + b * b
        gate = near * near / (like * like)
        w = gate * information[u]
        m = line[u] - start_slope[u]
        wx = w * dx
        wy = w * dy
        s0[u] += w
        s1[u] += wx
        s2[u] += wy
        s3[u] += wx * dx
        s4[u] += wx * dy
        s5[u] += wy * dy
        s6[u] += w * m
        s7[u] += wx * m
        s8[u] += wy * m
        s9[u] += w * m * m
        s10[u] += gate


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
        s, sx, sy = sums[0, u], sums[1, u], sums[2, u]
        xx = sums[3, u] + ridge
        xy = sums[4, u]
        yy = sums[5, u] + ridge
        sm, xm, ym = sums[6, u], sums[7, u], sums[8, u]
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
                rest = sums[9, u] - a * sm - b * xm - c * ym
                misfit[u] = rest / sums[10, u] if rest > 0 else np.float32(0)
                continue
        slope[u] = start_slope[u]
        variance[u] = np.float32(np.inf)
        misfit[u] = np.float32(0)
