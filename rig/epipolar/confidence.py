"""Sigma and label of every pixel: what is known, and what only seems so."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands, run_side_by_side
from rig.epipolar.line import MISFIT_LIMIT, LineFits
from rig.epipolar.plain import is_plain
from rig.epipolar.rank import departure
from rig.epipolar.verdict import weigh as weigh_rows
from rig.epipolar.views import SlopeMap

Map = NDArray[np.float32]
Mask = NDArray[np.bool_]

_CONTRADICTION = 0.55 * MISFIT_LIMIT
_SPOT_RADIUS_PX, _REGION_RADIUS_PX, _REGION_SHARE = 2, 15, 0.5
_HOLD_RADIUS_PX = 3
_SIDE_RADIUS_PX = 2
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
        weigh_rows(
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
