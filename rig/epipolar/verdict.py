"""Sigma, slope and label of every pixel from the sum of what is doubtful about it, row by row."""

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel
from rig.epipolar.chessboard import double_row
from rig.epipolar.line import UNSEEN
from rig.epipolar.views import Label

_SIDE_SHARE, _SIDE_LABELS = np.float32(0.3), 0.7
"""About a tenth of the pixels so close to a jump lie on the wrong side: root of 0.1 of the jump."""
_AGAINST, _PLAIN, _UNSEEN = 1, 2, 4
"""Doubts, as bits: the views contradict the slope; no texture; no other view shows the pixel."""
_NONE, _NEARER, _BEYOND, _OCCLUSION = (
    int(label) for label in (Label.NONE, Label.NEARER, Label.BEYOND, Label.OCCLUSION)
)


@kernel()
def weigh(
    slope_px: NDArray[np.float32],
    variance: NDArray[np.float32],
    kept: NDArray[np.float32],
    against: NDArray[np.bool_],
    plain: NDArray[np.bool_],
    sight: NDArray[np.uint8],
    start_px: np.float32,
    miss: np.float32,
    jump_px: NDArray[np.float32],
    rival_px: NDArray[np.float32],
    more_variance: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    unshared: NDArray[np.bool_],
    step_px: np.float32,
    low_end_px: np.float32,
    high_end_px: np.float32,
    blind_px: np.float32,
    is_misled: bool,
    start: int,
    stop: int,
    slope: NDArray[np.float32],
    sigma: NDArray[np.float32],
    label: NDArray[np.uint8],
    at_ends: NDArray[np.int64],
) -> None:
    """Add what every doubt makes of the variance; take the answer where there is none.

    A pixel near a jump may belong to the surface on its other side. A jump is a departure from the
    plane that the surroundings lie on: slanted surfaces have none. That error is bounded by what a
    hypothesis for the next frame may open: it ranks such pixels behind all others, and says too
    little where the pixel really lies on the other side.
    """
    width = slope_px.shape[1]
    total, known = np.empty(width, np.float32), np.empty(width, np.uint8)
    left, doubt = np.empty(width, np.float32), np.empty(width, np.uint8)
    some_left, some_doubts = np.empty(kept.shape[1], np.float32), np.empty(kept.shape[1], np.uint8)
    for v in range(start, stop):
        _doubt(against[v], plain[v], sight[v], some_doubts)
        for k in range(len(some_left)):
            some_left[k] = (start_px * kept[v, k]) * (start_px * kept[v, k]) + miss
        is_odd = v % 2 == 1
        double_row(some_left, is_odd, left)
        double_row(some_doubts, is_odd, doubt)
        m, far, rival = slope_px[v], jump_px[v], rival_px[v]
        _add_variances(m, variance[v], left, far, rival, step_px, total)
        if more_variance.shape[0] > 0:
            total += more_variance[v]
        _know(m, doubt, unshared[v], low_end_px, high_end_px, known, at_ends[v])
        _tell(m, total, doubt, known, is_misled, blind_px, slope[v], sigma[v])
        _name(m, hidden[v], known, label[v])


@kernel()
def _doubt(
    against: NDArray[np.bool_],
    plain: NDArray[np.bool_],
    sight: NDArray[np.uint8],
    doubts: NDArray[np.uint8],
) -> None:
    """Fill in the doubts of a row as bits."""
    none = np.uint8(0)
    for k in range(len(doubts)):
        said = np.uint8(_AGAINST) if against[k] else none
        said |= np.uint8(_PLAIN) if plain[k] else none
        doubts[k] = said | (np.uint8(_UNSEEN) if sight[k] == UNSEEN else none)


# Loops of few arrays each: of more, the compiler does not ask whether any overlap, and gives up on
# vectors.


@kernel()
def _add_variances(
    slope_px: NDArray[np.float32],
    variance: NDArray[np.float32],
    left: NDArray[np.float32],
    jump_px: NDArray[np.float32],
    rival_px: NDArray[np.float32],
    step_px: np.float32,
    total: NDArray[np.float32],
) -> None:
    least_jump, largest = np.float32(1.5) * step_px, np.float32(_SIDE_LABELS) * step_px
    zero, infinite = np.float32(0), np.float32(np.inf)
    for u in range(len(total)):
        total[u] = variance[u] + left[u]
    for u in range(len(total)):
        side = min(_SIDE_SHARE * jump_px[u], largest)
        total[u] += side * side if jump_px[u] > least_jump else zero
    for u in range(len(total)):
        apart = rival_px[u] - slope_px[u]
        total[u] += apart * apart if abs(apart) < infinite else zero


@kernel()
def _know(
    slope_px: NDArray[np.float32],
    doubts: NDArray[np.uint8],
    unshared: NDArray[np.bool_],
    low_end_px: np.float32,
    high_end_px: np.float32,
    known: NDArray[np.uint8],
    at_ends: NDArray[np.int64],
) -> None:
    """Fill in 1 where there is an answer; count pixels with texture at the ends of the range."""
    none = np.uint8(_PLAIN | _UNSEEN)
    for u in range(len(known)):
        inside = (slope_px[u] >= low_end_px) & (slope_px[u] <= high_end_px)
        known[u] = inside & ((doubts[u] & none) == 0) & (not unshared[u])
    low = high = np.int32(0)
    for u in range(len(known)):
        told = (doubts[u] & np.uint8(_PLAIN)) == 0
        low += np.int32(1) if told & (slope_px[u] < low_end_px) else np.int32(0)
        high += np.int32(1) if told & (slope_px[u] > high_end_px) else np.int32(0)
    at_ends[0], at_ends[1] = low, high


@kernel()
def _tell(
    slope_px: NDArray[np.float32],
    total: NDArray[np.float32],
    doubts: NDArray[np.uint8],
    known: NDArray[np.uint8],
    is_misled: bool,
    blind_px: np.float32,
    slope: NDArray[np.float32],
    sigma: NDArray[np.float32],
) -> None:
    """Fill in slope and sigma: of a blind guess at least in what is doubtful, NaN where unknown."""
    nan, against = np.float32(np.nan), np.uint8(_AGAINST)
    for u in range(len(total)):
        total[u] = min(np.sqrt(total[u]), blind_px)
    for u in range(len(total)):
        is_doubtful = ((doubts[u] & against) != 0) | is_misled
        total[u] = blind_px if is_doubtful else total[u]
    for u in range(len(total)):
        sigma[u] = total[u] if known[u] else nan
    for u in range(len(total)):
        slope[u] = slope_px[u] if known[u] else nan


@kernel()
def _name(
    slope_px: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    known: NDArray[np.uint8],
    label: NDArray[np.uint8],
) -> None:
    """Fill in the labels."""
    for u in range(len(label)):
        side = np.uint8(_NEARER) if slope_px[u] > np.float32(0) else np.uint8(_BEYOND)
        seen = np.uint8(_OCCLUSION) if hidden[u] else side
        label[u] = seen if known[u] else np.uint8(_NONE)
