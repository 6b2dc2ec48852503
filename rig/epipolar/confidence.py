"""Sigma and label of every pixel: what is known, and what only seems so."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands, run_side_by_side
from rig.compute.kernel import kernel
from rig.epipolar.chessboard import double_row
from rig.epipolar.line import MISFIT_LIMIT, UNSEEN, LineFits
from rig.epipolar.plain import is_plain
from rig.epipolar.rank import departure
from rig.epipolar.views import Label, SlopeMap

Map = NDArray[np.float32]
Mask = NDArray[np.bool_]

_CONTRADICTION = 0.55 * MISFIT_LIMIT
_SPOT_RADIUS_PX, _REGION_RADIUS_PX, _REGION_SHARE = 2, 15, 0.5
_HOLD_RADIUS_PX = 3
_SIDE_RADIUS_PX, _SIDE_SHARE, _SIDE_LABELS = 2, np.float32(0.3), 0.7
"""About a tenth of the pixels so close to a jump lie on the wrong side: root of 0.1 of the jump."""
_EDGE_LABELS = 1.0
"""Slopes that end so near to the end of the range may lie beyond it."""
_MANY_OUTSIDE = 0.02
_AGAINST, _PLAIN, _UNSEEN = 1, 2, 4
"""Doubts, as bits: the views contradict the slope; no texture; no other view shows the pixel."""
_NONE, _NEARER, _BEYOND, _OCCLUSION = (
    int(label) for label in (Label.NONE, Label.NEARER, Label.BEYOND, Label.OCCLUSION)
)
_MISLED = (
    "the views contradict the hypothesis in most places; nothing is sure in this multi-view, "
    "search the next one without it"
)


@dataclass(frozen=True, slots=True)
class Evidence:
    """What an estimate knows about its slopes besides them."""

    lines: LineFits
    """The fit of every pixel's own line."""
    variance: Map
    """(H, W) of the stitched slopes, by noise or by the scatter of the neighbours' lines."""
    views: int
    """How many there are."""
    misfit_px: float
    """By how much lines miss each other, as an error of the slopes, 1 sigma."""
    hidden: Mask
    """(H, W) pixels hidden in the outermost view of at least one side."""
    unshared: Mask
    """(H, W) slopes that a search from the other end of the views does not share."""
    start_px: float
    """Error of the slopes before the line fit, 1 sigma."""
    rival_px: Map
    """(H, W) second slopes that explain the views as well, NaN for none."""
    drift_variance: Map | None = None
    """(H, W) of the slopes, by light that changes with the view; None where none does."""
    unconfirmed_variance: Map | None = None
    """(H, W) of slopes that the other view of a pair does not confirm clearly; None for none."""
    confirmed: Mask | None = None
    """(H, W) slopes that a search from the other end of the views shares; None for no such search.
    """
    coarse_texture: Mask | None = None
    """(H, W) texture that pictures of half the size show; None where none was looked for."""
    against: Mask | None = None
    """Where the views do not agree with the slope, as the lines; None to ask `contradicted`."""
    is_misled: bool = False
    """Whether the hypothesis that the slopes were searched around is wrong altogether."""


def judge(
    slope_px: Map,
    evidence: Evidence,
    step_px: float,
    range_px: tuple[float, float],
    warnings: tuple[str, ...],
) -> SlopeMap:
    """Turn the stitched fit into sigma and labels.

    The variance of the stitched plane rests on the grey noise around every pixel, or on the scatter
    of the neighbours' lines where that is larger.

    Where the views contradict the slope (a wrong hypothesis, a mirroring surface), or two slopes
    explain them, sigma says so: as the next frame's hypothesis it opens the search again.

    No answer is given where the texture around is no more than noise, where no other view sees the
    pixel, and where the slope ends at the end of the range, beyond which it may lie.

    Args:
        slope_px: (H, W) stitched slopes, px per view step.
        evidence: what else is known.
        step_px: distance of neighbouring labels, px per view step.
        range_px: slopes that were searched.
        warnings: what is to be said besides.
    """
    lines, blind_px = evidence.lines, np.float32((range_px[1] - range_px[0]) / 12**0.5)
    kept, plain = _held_back(lines), is_plain(lines, evidence.views)
    jump_px = departure(slope_px, _SIDE_RADIUS_PX)
    against = contradicted(lines) if evidence.against is None else evidence.against
    if evidence.coarse_texture is not None:
        plain = plain & ~evidence.coarse_texture
    if evidence.confirmed is not None:
        # Two views that find each other, differ by light or by lenses: not by slope.
        against = against & ~evidence.confirmed
    more = [evidence.drift_variance, evidence.unconfirmed_variance]
    more = [part for part in more if part is not None]
    more_variance = np.sum(more, axis=0) if more else np.empty((0, 0), np.float32)
    slope, sigma = np.empty_like(slope_px), np.empty_like(slope_px)
    label, at_ends = np.empty(slope_px.shape, np.uint8), np.zeros((len(slope_px), 2), np.int64)
    near_px = min(_EDGE_LABELS * step_px, 0.1 * (range_px[1] - range_px[0]))
    ends_px = np.float32(range_px[0] + near_px), np.float32(range_px[1] - near_px)

    def weigh(start: int, stop: int) -> None:
        _weigh(
            slope_px, evidence.variance, kept, against, plain, lines.sight,
            np.float32(evidence.start_px), np.float32(evidence.misfit_px**2), jump_px,
            evidence.rival_px, more_variance, evidence.hidden, evidence.unshared,
            np.float32(step_px), *ends_px, blind_px, evidence.is_misled, start, stop,
            slope, sigma, label, at_ends,
        )  # fmt: skip

    run_in_bands(weigh, len(sigma))
    said = (_MISLED,) if evidence.is_misled else ()
    said += _of_range(at_ends.sum(axis=0) / sigma.size, range_px)
    return SlopeMap(slope, sigma, label, warnings + said)


@kernel()
def _weigh(
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


def _held_back(lines: LineFits) -> Map:
    """Share of the start's error that one step leaves, (H, W).

    Grey noise makes lines look steeper than they are, so that each step is too short.
    """
    signal, all_of_it = run_side_by_side(
        lambda: lines.around(lines.signal, _HOLD_RADIUS_PX),
        lambda: lines.around(lines.information, _HOLD_RADIUS_PX),
    )
    share = signal / np.maximum(all_of_it, np.float32(1e-12))
    return np.float32(1) - np.minimum(np.maximum(share, np.float32(0)), np.float32(1))


def contradicted(lines: LineFits) -> Mask:
    """Where the views do not agree with the slope.

    Args:
        lines: the fit of every pixel's own line.

    Returns:
        A map as theirs. Where half of a region is contradicted, the rest of it agrees by chance.
    """
    spot = lines.around(lines.misfit, _SPOT_RADIUS_PX) > np.float32(_CONTRADICTION)
    region = lines.around(spot.astype(np.float32), _REGION_RADIUS_PX) > _REGION_SHARE
    return spot | region


def _of_range(shares: Float, range_px: tuple[float, float]) -> tuple[str, ...]:
    """Say which share of the pixels lies at either end of the range, where it is more than chance.

    Args:
        shares: (2,) of all pixels, at the low end and at the high one.
        range_px: slopes that were searched.
    """
    return tuple(
        f"{100 * share:.0f} % of the pixels are at the {name} end of the searched slopes "
        f"[{range_px[0]:g}, {range_px[1]:g}] px per view step and get no answer; widen "
        "slopes.range_px or range_mm"
        for name, share in zip(("far", "near"), shares.tolist(), strict=True)
        if share > _MANY_OUTSIDE
    )
