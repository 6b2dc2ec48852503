"""Sigma and label of every pixel: what is known, and what only seems so."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands, run_side_by_side
from rig.epipolar.chessboard import doubled
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
    beside_unshared: Mask
    """(H, W) slopes at a jump beside those."""
    start_px: float
    """Error of the slopes before the line fit, 1 sigma."""
    rival_px: Map
    """(H, W) second slopes that explain the views as well, NaN for none."""
    drift_variance: Map | None = None
    """(H, W) of the slopes, by light that changes with the view; None where none does."""
    coarse_texture: Mask | None = None
    """(H, W) texture that pictures of half the size show; None where none was looked for."""
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
    start_px, miss = np.float32(evidence.start_px), np.float32(evidence.misfit_px**2)
    kept, side_px, against, plain = run_side_by_side(
        lambda: _held_back(lines),
        lambda: _other_side(slope_px, step_px),
        lambda: contradicted(lines),
        lambda: is_plain(lines, evidence.views),
    )
    sight = lines.sight
    if lines.is_thin:
        wide = slope_px.shape[1]
        kept, against, plain, sight = (doubled(m, wide) for m in (kept, against, plain, sight))
    if evidence.coarse_texture is not None:
        plain[evidence.coarse_texture] = 0
    sigma, label = np.empty_like(slope_px), np.empty(slope_px.shape, np.uint8)
    outside = _ends(slope_px, step_px, range_px)
    slope = slope_px.copy()

    def weigh(start: int, stop: int) -> None:
        r = slice(start, stop)
        total = evidence.variance[r] + (start_px * kept[r]) ** 2 + side_px[r] ** 2 + miss
        if evidence.drift_variance is not None:
            total += evidence.drift_variance[r]
        apart = evidence.rival_px[r] - slope[r]
        total += np.where(np.isfinite(apart), apart * apart, np.float32(0))
        np.minimum(np.sqrt(total), blind_px, out=sigma[r])
        doubtful = (against[r] > 0) | evidence.beside_unshared[r] | evidence.is_misled
        np.copyto(sigma[r], blind_px, where=doubtful)
        label[r] = np.where(slope[r] > 0, np.uint8(Label.NEARER), np.uint8(Label.BEYOND))
        label[r][evidence.hidden[r]] = Label.OCCLUSION
        none = (
            (plain[r] > 0) | (sight[r] == UNSEEN) | (outside[r] != 0) | evidence.unshared[r]
        )
        for values, instead in ((label, Label.NONE), (slope, np.nan), (sigma, np.nan)):
            values[r][none] = instead

    run_in_bands(weigh, len(sigma))
    said = (_MISLED,) if evidence.is_misled else ()
    return SlopeMap(slope, sigma, label, warnings + said + _of_range(outside, plain, range_px))


def _held_back(lines: LineFits) -> Map:
    """Share of the start's error that one step leaves, (H, W).

    Grey noise makes lines look steeper than they are, so that each step is too short.
    """
    signal, all_of_it = (
        lines.around(m, _HOLD_RADIUS_PX) for m in (lines.signal, lines.information)
    )
    share = signal / np.maximum(all_of_it, np.float32(1e-12))
    return np.float32(1) - np.minimum(np.maximum(share, np.float32(0)), np.float32(1))


def _other_side(slope_px: Map, step_px: float) -> Map:
    """Error of a pixel near a jump that may belong to the surface on its other side, (H, W).

    A jump is a departure from the plane that the surroundings lie on: slanted surfaces have none.
    Bounded by what a hypothesis for the next frame may open: it ranks such pixels behind all
    others, and says too little where the pixel really lies on the other side.
    """
    jump = departure(slope_px, _SIDE_RADIUS_PX)
    error = np.minimum(_SIDE_SHARE * jump, np.float32(_SIDE_LABELS * step_px))
    return np.where(jump > np.float32(1.5 * step_px), error, np.float32(0))


def contradicted(lines: LineFits) -> Map:
    """1 where the views do not agree with the slope, else 0.

    Args:
        lines: the fit of every pixel's own line.

    Returns:
        A map as theirs. Where half of a region is contradicted, the rest of it agrees by chance.
    """
    spot = lines.around(lines.misfit, _SPOT_RADIUS_PX) > np.float32(_CONTRADICTION)
    region = lines.around(spot.astype(np.float32), _REGION_RADIUS_PX) > _REGION_SHARE
    return (spot | region).astype(np.float32)


def _ends(slope_px: Map, step_px: float, range_px: tuple[float, float]) -> NDArray[np.int8]:
    """-1 at the low end of the range, 1 at the high one, (H, W)."""
    near = np.float32(min(_EDGE_LABELS * step_px, 0.1 * (range_px[1] - range_px[0])))
    ends = (slope_px > range_px[1] - near).astype(np.int8)
    ends -= (slope_px < range_px[0] + near).astype(np.int8)
    return ends


def _of_range(
    outside: NDArray[np.int8], plain: Map, range_px: tuple[float, float]
) -> tuple[str, ...]:
    """Say which share of the pixels lies at an end of the range, where that is more than chance."""
    said: list[str] = []
    for end, name in ((-1, "far"), (1, "near")):
        share = np.count_nonzero((outside == end) & (plain == 0)) / outside.size
        if share > _MANY_OUTSIDE:
            said.append(
                f"{100 * share:.0f} % of the pixels are at the {name} end of the searched slopes "
                f"[{range_px[0]:g}, {range_px[1]:g}] px per view step and get no answer; widen "
                "slopes.range_px"
            )
    return tuple(said)
