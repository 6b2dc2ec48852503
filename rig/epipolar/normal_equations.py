"""The normal equations of a line: what its views add to them, and their solution.

The first axis of every array is a view or a sum, the last a pixel of a row.
"""

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel

SUMS = 9
W, _WJ, _WG, _WJJ, _WJG, _NOISE_JJ, _WGG, WW, _NOISE_JG = range(SUMS)
"""The sums over the views i of a pixel, by index: weights w, tilts j (grey per px per step), grey
differences g to the reference; what noise alone puts into the sums of jj and of jg; and w squared.
"""


@kernel()
def lock(
    places: NDArray[np.float32],
    slope: NDArray[np.float32],
    step: np.float32,
    locking: NDArray[np.float32],
    drawn: NDArray[np.float32],
) -> None:
    """Add what noise makes of the product of grey value and tilt, by one axis.

    A polynomial of the place s between two pixels, from -0.5 to 0.5: odd, since the two sides of
    the middle are mirror images.
    """
    c1, c3, c5 = locking[0], locking[1], locking[2]
    half = np.float32(0.5)
    for u in range(len(drawn)):
        place = places[u] - slope[u] * step
        s = place - np.floor(place) - half
        s2 = s * s
        drawn[u] -= step * s * (c1 + s2 * (c3 + s2 * c5))


@kernel()
def add_view(
    grey: NDArray[np.float32],
    tilt: NDArray[np.float32],
    seen: NDArray[np.float32],
    members: NDArray[np.float32],
    lock: NDArray[np.float32],
    per_scale: np.float32,
    noise: np.float32,
    sums: NDArray[np.float32],
) -> None:
    """Add one view to the sums; a view of a hidden half, or outside the picture, has weight 0."""
    one, zero = np.float32(1), np.float32(0)
    sw, swj, swg, swjj, swjg = sums[W], sums[_WJ], sums[_WG], sums[_WJJ], sums[_WJG]
    swgg, sww, swn, swl = sums[_WGG], sums[WW], sums[_NOISE_JJ], sums[_NOISE_JG]
    for u in range(len(grey)):
        g, j = grey[u], tilt[u]
        t = g * per_scale
        w = (seen[u] if members[u] > zero else zero) / (one + t * t)
        wj = w * j
        sw[u] += w
        swj[u] += wj
        swg[u] += w * g
        swjj[u] += wj * j
        swjg[u] += wj * g
        swn[u] += w * noise
        swgg[u] += w * g * g
        sww[u] += w * w
        swl[u] += w * lock[u]


@kernel()
def step(
    sums: NDArray[np.float32],
    reach: np.float32,
    start_slope: NDArray[np.float32],
    slope: NDArray[np.float32],
    information: NDArray[np.float32],
    signal: NDArray[np.float32],
    scatter: NDArray[np.float32],
    freedom: NDArray[np.float32],
) -> None:
    """Solve for slope and grey value; the grey value is eliminated (mean-centred sums).

    info = sum w j^2 - (sum w j)^2 / sum w, cross = sum w j g - (sum w j)(sum w g) / sum w, and the
    step is d = -cross / info. Centring takes the share 1 / sum w of every variance away, hence the
    factors 1 - 1 / sum w at what noise alone puts into the sums; freedom, what the scatter is for a
    noise of 1 where one value and one slope are fitted, is sum w - 2 sum w^2 / sum w.
    """
    one, zero = np.float32(1), np.float32(0)
    sw, swj, swg, swjj, swjg = sums[W], sums[_WJ], sums[_WG], sums[_WJJ], sums[_WJG]
    swgg, sww, swn, swl = sums[_WGG], sums[WW], sums[_NOISE_JJ], sums[_NOISE_JG]
    for u in range(len(slope)):
        info = swjj[u] - swj[u] * swj[u] / sw[u]
        cross = swjg[u] - swj[u] * swg[u] / sw[u] - swl[u] * (one - one / sw[u])
        known = info > np.float32(1e-12)
        move = max(min(-cross / info, reach), -reach)
        slope[u] = start_slope[u] + (move if known else np.float32(0))
        information[u] = info if known else np.float32(0)
        signal[u] = information[u] - swn[u] * (one - one / sw[u])
        explained = cross * cross / info if known else zero
        scatter[u] = max(swgg[u] - swg[u] * swg[u] / sw[u] - explained, zero)
        freedom[u] = max(sw[u] - np.float32(2) * sww[u] / sw[u], zero)
