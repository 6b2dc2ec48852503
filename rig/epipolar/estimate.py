"""The dense slope estimator: from rectified views to slope, sigma and label of every pixel."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_side_by_side
from rig.epipolar.chessboard import doubled, filled, thinned
from rig.epipolar.confidence import Evidence, contradicted, judge
from rig.epipolar.contest import contested
from rig.epipolar.drift import coarse_drift, local_drift, variance_of_slopes
from rig.epipolar.line import LineFits, fit_lines
from rig.epipolar.median import guided_median, near_jumps
from rig.epipolar.noise.local import line_precision, locking, pooled_share, reply_share
from rig.epipolar.noise.model import CrossNoise, NoiseModel
from rig.epipolar.occlusion import hidden_points
from rig.epipolar.placement.fit import find_placement
from rig.epipolar.placement.placement import Placement, on_their_lines
from rig.epipolar.plain import has_coarse_texture
from rig.epipolar.prepare import Ready, closer_noise, prepare
from rig.epipolar.rank import highest
from rig.epipolar.sampling import pad
from rig.epipolar.scales import Scales
from rig.epipolar.search.cross_check import is_one_sided
from rig.epipolar.search.pair import LABELS_PX, PAIR_ERROR_PX
from rig.epipolar.search.search import Effort, search
from rig.epipolar.search.sides import choose_sides
from rig.epipolar.search.window import LABEL_SHIFT_PX, Cameras, Window, window_of
from rig.epipolar.steady import Steady, Turn
from rig.epipolar.stitch import behind_jumps, stitch
from rig.epipolar.views import RectifiedViews, SlopeMap, SlopePrior

Stitched = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Slope and its variance, which counts how far neighbours scatter beyond theirs; both (H, W)."""

_FEWEST_THIN = 3
"""Views from which on every second pixel of a followed frame will do."""

_MEDIAN_RADIUS_PX = 4
_MEDIAN_ROUNDS = {Effort.FOLLOWED: 1, Effort.COARSE: 1, Effort.FULL: 2}
"""One where the edges have been settled before: in the last frame, at half size."""
_JUMP_LABELS = 3.0
"""A pixel whose window is narrower than this cannot change to the other side of a jump."""
_STITCH_RADIUS_PX, _STITCH_STRIDE_PX = 6, 2
_MUCH_LESS = 0.8
"""Noise at the slopes found over that of the first match, from which the first match was wrong."""
_START_LABELS = 0.15
"""Error of the slopes before the line fit, in labels, 1 sigma."""
_FROM_ROWS = 0.5
"""Error along a line over that across it: slanted edges turn one into the other."""


@dataclass(frozen=True, slots=True)
class _Found:
    """What slopes are like that come straight from a search."""

    error_px: float
    """As a shift in the outermost view, 1 sigma."""
    mended: float
    """How much of it the line fit mends: the power of the reply by which steps are made longer. At
    1 nothing is left, and the noise of the lines grows most."""


_NEAR = _Found(0.25 * LABEL_SHIFT_PX, mended=0.5)
_FAR = _Found(0.5 * LABEL_SHIFT_PX, mended=1.0)
"""At full size and at half size."""
_KNOWN_LABELS, _SURPRISE = 8.0, 0.5
"""Width of a window that a hypothesis is sure of; and share of such pixels that the views must
contradict for it to be wrong altogether."""
_COVERED_LABELS = 1.0
"""Difference of slope, labels, from which a nearer surface covers what is behind it."""


def estimate_slopes(
    views: RectifiedViews,
    slope_range_px: tuple[float, float],
    prior: SlopePrior | None = None,
    *,
    noise: NoiseModel | None = None,
    trust_places: bool = False,
) -> SlopeMap:
    """Estimate the slope of the epipolar line through every pixel of the reference view.

    Half-cost plane sweep, semi-global aggregation, guided median and choice of sides at slope
    edges, one Gauss-Newton step per line, locally linear stitching; each module names its source.
    Every grey scale comes from the noise, as measured or as the images show it, and from texture;
    where noise grows with light, from the noise of each pixel's own grey value. Errors of the
    places that the views are told to have are looked for where there is no hypothesis everywhere.

    Args:
        views: two or more rectified views.
        slope_range_px: lowest and highest slope to search, px per view step.
        prior: slope hypothesis; where it is finite, only its mean +- 2 sigma is searched.
        noise: noise of the grey values (in colour: of each channel) as measured; None for that of
            the views or, where they come without, what the images themselves show.
        trust_places: whether the views are exactly where they are told to be, so that no errors of
            their places are looked for.

    Returns:
        Slope, sigma and label of every reference pixel.

    Raises:
        SlopeError: the range is empty, the prior has another shape, an image is not finite, or
            no view but the reference can be used.
    """
    window = window_of(views.shape, slope_range_px, prior)
    steady = None if prior is None else prior.steady
    return _estimate(views, window, slope_range_px, noise, None, steady, trust_places=trust_places)


def _estimate(
    views: RectifiedViews,
    window: Window,
    slope_range_px: tuple[float, float],
    noise: NoiseModel | None,
    rough_noise: CrossNoise | None,
    steady: Steady | None,
    *,
    trust_places: bool,
) -> SlopeMap:
    """Do what `estimate_slopes` says.

    Where the slopes found show much less noise than the first match did, which was wrong then, they
    are looked for once more.

    Args:
        views: as they come.
        window: the slopes to search.
        slope_range_px: lowest and highest of them.
        noise: as told.
        rough_noise: what the views differ by; None to measure it at the first match.
        steady: what the last multi-view told beside its slopes; None to measure it.
        trust_places: whether the views are where they are told to be.
    """
    ready = prepare(views, window, noise, rough_noise, steady)
    cameras, scales, mending = ready.cameras, ready.scales, ready.mending
    images, splines, grey = ready.images, ready.splines, ready.images[ready.cameras.reference]
    drift = broad_drift = _broad_drift(ready, window)
    found = search(
        images, cameras, window, scales, splines, drift, _known_rivals(ready), ready.effort
    )
    movable = window.is_wider(_JUMP_LABELS * cameras.step_px)
    edged = window.hold(_settle_edges(window.hold(found.slope_px), movable, ready))
    if ready.effort is Effort.COARSE or ready.is_one_sided:
        nowhere = np.zeros(images.shape, np.bool_)
        _, (joined, _) = _refine(images, splines, edged, nowhere, cameras, scales, drift, _FAR)
        first_slope = window.hold(_within_reach(edged, joined, ready))
    else:
        first_slope = edged
    if mending.noise is None and ready.effort is not Effort.FOLLOWED:
        closer = closer_noise(ready, first_slope)
        was_wrong = closer.ratio < _MUCH_LESS * ready.noise.excess
        if rough_noise is None and ready.noise.excess > 1 and was_wrong:
            own = CrossNoise()  # what single pictures tell
            return _estimate(
                views, window, slope_range_px, noise, own, None, trust_places=trust_places
            )
        mending = replace(mending, noise=closer)
    cross = mending.noise or CrossNoise()
    scales = replace(scales, misfit_px=cross.misfit_px)
    drift_variance = None
    if drift is not None:
        told = local_drift(images, splines, first_slope, drift, cameras, scales)
        drift, drift_variance = (None, None) if told is None else told
    sided = window.hold(choose_sides(splines, grey, first_slope, movable, cameras, scales, drift))
    is_thin = ready.before is not None and len(images) >= _FEWEST_THIN
    covered, hidden = hidden_points(
        sided, cameras.x_steps, cameras.y_steps, _COVERED_LABELS * cameras.step_px, scales.blur_px,
        is_thin=is_thin,
    )  # fmt: skip
    if is_thin:
        hidden = doubled(hidden, grey.shape[1])
    start = _NEAR if ready.effort is Effort.FULL else None
    lines, (stitched, variance) = _refine(
        images, splines, sided, covered, cameras, scales, drift, start, is_thin=is_thin
    )
    slope = window.hold(_within_reach(sided, stitched, ready))
    warnings, placement = ready.warnings, None
    if ready.effort is not Effort.FOLLOWED and not trust_places:
        levels = scales.smoothed_noise
        placement = find_placement(images, slope, covered, cameras, levels, splines, drift)
    places = placement
    if placement is not None and placement.misplaced.any():
        warnings += placement.warnings(cameras.x_steps, cameras.y_steps)
        placed = on_their_lines(images, placement.beside_px)
        placed_cameras = _moved(cameras, placement)
        placed_splines = pad(placed, placed_cameras.x_steps, placed_cameras.y_steps)
        lines, (stitched, variance) = _refine(
            placed, placed_splines, slope, covered, placed_cameras, scales, drift
        )
        slope = window.hold(stitched)
    else:
        placement, placed_cameras, placed_splines = None, cameras, splines
    pooled = _pooled_share(ready, cross)
    variance *= np.float32(pooled)
    rival_px = found.rival_px
    holds_out = contested(placed_splines, slope, rival_px, placed_cameras, scales, grey, drift)
    rival_px[~holds_out] = np.nan
    if drift_variance is not None:
        drift_variance = variance_of_slopes(drift_variance, grey, placed_cameras)
    misfit_px = _FROM_ROWS * mending.rows.scatter_px
    start_px, coarse_texture = _START_LABELS * LABEL_SHIFT_PX, None
    if is_one_sided(placed_cameras):
        # What two views miss each other by, neighbours share, and no third one tells.
        misfit_px, start_px = float(np.hypot(misfit_px, cross.misfit_px)), PAIR_ERROR_PX
        is_row = bool(np.abs(cameras.x_steps).max() >= np.abs(cameras.y_steps).max())
        centre = ready.sharp[cameras.reference]
        coarse_texture = has_coarse_texture(centre, scales, is_row=is_row)
    per_shift = placed_cameras.step_px / LABEL_SHIFT_PX
    evidence = Evidence(
        lines=lines,
        variance=variance,
        views=len(images),
        misfit_px=misfit_px * per_shift,
        hidden=hidden,
        unshared=found.unshared,
        beside_unshared=_beside(found.unshared, slope, placed_cameras),
        start_px=start_px * per_shift,
        rival_px=rival_px,
        drift_variance=drift_variance,
        coarse_texture=coarse_texture,
        is_misled=ready.effort is Effort.FOLLOWED and _is_misled(lines, window, placed_cameras),
    )
    judged = judge(slope, evidence, placed_cameras.step_px, slope_range_px, warnings)
    judged = _with_doubt_of(places, judged, slope_range_px[1] - slope_range_px[0])
    # Around a hypothesis nothing is looked for: what is not known then is not known to be right.
    is_looked_for = views.mending is not None or ready.effort is not Effort.FOLLOWED
    return replace(
        judged,
        placement=placement,
        mending=mending if is_looked_for else None,
        steady=_handed_on(ready, pooled, broad_drift, rival_px, slope),
    )


def _broad_drift(ready: Ready, window: Window) -> NDArray[np.float32] | None:
    """Light that changes with the view, before slopes are known."""
    if ready.before is not None and not ready.is_due(Turn.DRIFT):
        return ready.before.drift
    return coarse_drift(ready.images, ready.cameras, window, ready.first)


def _known_rivals(ready: Ready) -> NDArray[np.float32] | None:
    """Second slopes of the last multi-view where unknown pixels keep them; None to search."""
    if ready.before is None or ready.is_due(Turn.UNKNOWN):
        return None
    return ready.before.rival_px


def _pooled_share(ready: Ready, cross: CrossNoise) -> float:
    """How much less than independent ones the lines of neighbours tell."""
    if ready.before is not None and not ready.is_due(Turn.NOISE):
        return ready.before.pooled_share
    grey = ready.images[ready.cameras.reference]
    return pooled_share(grey, ready.scales, _STITCH_STRIDE_PX, cross.likeness)


def _handed_on(
    ready: Ready,
    pooled_share: float,
    drift: NDArray[np.float32] | None,
    rival_px: NDArray[np.float32],
    slope_px: NDArray[np.float32],
) -> Steady | None:
    """What the next multi-view need not measure; None where the views have no common gains."""
    if ready.gains is None:
        return None
    before, wide_share = ready.before, ready.wide_share
    if before is not None and not ready.is_due(Turn.UNKNOWN):
        wide_share = before.wide_share
    return Steady(
        ready.cameras.x_steps,
        ready.cameras.y_steps,
        ready.gains,
        ready.grading,
        pooled_share,
        drift,
        rival_px,
        slope_px,
        wide_share,
        turn=Turn.GAINS if before is None else before.next_turn(),
    )


def _within_reach(
    slope_px: NDArray[np.float32], stitched_px: NDArray[np.float32], ready: Ready
) -> NDArray[np.float32]:
    """Slopes that stitching has moved no farther than one step of a line reaches, (H, W).

    Farther ones come from planes of another surface. With more views the lines tell surfaces apart;
    a pair stays with what the search has found.
    """
    if not ready.is_one_sided:
        return stitched_px
    is_near = np.abs(stitched_px - slope_px) <= np.float32(ready.cameras.step_px)
    return np.where(is_near, stitched_px, slope_px)


def _beside(
    unshared: NDArray[np.bool_], slope_px: NDArray[np.float32], cameras: Cameras
) -> NDArray[np.bool_]:
    """Pixels at a jump beside what is not shared, (H, W): paths make ramps of such jumps.

    Less than a label of the search is no jump, but how its labels are told where texture is weak.
    """
    if not unshared.any():
        return unshared
    beside = highest(unshared.astype(np.float32), 3) > 0
    return beside & near_jumps(slope_px, LABELS_PX / LABEL_SHIFT_PX * cameras.step_px, 1)


def _is_misled(lines: LineFits, window: Window, cameras: Cameras) -> bool:
    """Whether the views contradict a good share of the slopes that were taken for known.

    The scene has jumped then, and the hypothesis is no guide: what agrees with it does so by
    chance. What the hypothesis called unsure itself does not count: a mirror contradicts every
    frame.
    """
    known = ~window.is_wider(_KNOWN_LABELS * cameras.step_px)
    if lines.is_thin:
        known = thinned(known)
    against = contradicted(lines) > 0
    return bool(np.count_nonzero(against & known) > _SURPRISE * max(np.count_nonzero(known), 1))


def _with_doubt_of(places: Placement | None, found: SlopeMap, range_px: float) -> SlopeMap:
    """Add to sigma what is unknown about the places, up to that of a blind guess."""
    if places is None:
        return found
    sigma_px = np.hypot(found.sigma_px, places.slope_sigma_px(found.slope_px))
    return replace(found, sigma_px=np.minimum(sigma_px, np.float32(range_px / 12**0.5)))


def _moved(cameras: Cameras, placement: Placement) -> Cameras:
    x_steps = cameras.x_steps + placement.steps[:, 0]
    return Cameras(x_steps, cameras.y_steps + placement.steps[:, 1], cameras.reference)


def _settle_edges(
    slope_px: NDArray[np.float32], movable: NDArray[np.bool_], ready: Ready
) -> NDArray[np.float32]:
    """Move slope edges to the grey edges of the reference view, where they may move."""
    for _ in range(_MEDIAN_ROUNDS[ready.effort]):
        jumps = near_jumps(slope_px, 1.5 * ready.cameras.step_px, _MEDIAN_RADIUS_PX)
        slope_px = guided_median(
            slope_px,
            ready.images[ready.cameras.reference],
            jumps & movable,
            radius_px=_MEDIAN_RADIUS_PX,
            grey_scale=1.4 * ready.scales.likeness,
        )
    return slope_px


def _refine(
    images: NDArray[np.float32],
    splines: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    covered: NDArray[np.bool_],
    cameras: Cameras,
    scales: Scales,
    drift: NDArray[np.float32] | None,
    found: _Found | None = None,
    *,
    is_thin: bool = False,
) -> tuple[LineFits, Stitched]:
    """Move every pixel's line one step towards its optimum, and join the optima of neighbours.

    A step falls short of the optimum, which does no harm where the start is as good as the line.
    The error of a search follows the fraction of a pixel and the nearer surfaces around: where the
    start comes from one, steps are made longer.

    Args:
        images: (V, H, W) equalised grey values.
        splines: what `rig.epipolar.sampling.pad` makes of them.
        slope_px: (H, W) start, px per view step.
        covered: (V, H, W) whether a view shows a nearer surface in the place of the point.
        cameras: where the views stand.
        scales: grey scales of the images.
        drift: (2, H, W) light that changes with the view; None for none.
        found: the search that the start comes from; None if it comes from lines already.
        is_thin: whether the lines of every second pixel will do; their maps, and `covered`, are
            thin ones then.
    """
    if found is not None:
        scales = replace(scales, start_error_px=found.error_px)
    lines = fit_lines(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, slope_px, covered,
        scales.doubt, scales.derivative_variance, locking(scales), cameras.step_px, splines,
        drift, is_thin=is_thin,
    )  # fmt: skip
    if found is not None:
        longer = np.float32(1.0 / reply_share(lines, scales) ** found.mended)
        lines = replace(lines, slope_px=slope_px + longer * (lines.slope_px - slope_px))
    return lines, _stitch(slope_px, lines, images[cameras.reference], cameras, scales)


def _stitch(
    slope_px: NDArray[np.float32],
    lines: LineFits,
    grey: NDArray[np.float32],
    cameras: Cameras,
    scales: Scales,
) -> Stitched:
    """Join neighbours whose slopes differ by no more than the lines themselves are uncertain."""
    information = line_precision(lines, scales)
    line_sigma_px = 1.0 / max(float(np.median(information[::4, ::4])), 1e-12) ** 0.5
    step_px = cameras.step_px
    slope_gate_px = max(1.5 * step_px, min(7.5 * line_sigma_px, 6.0 * step_px))
    near_px, start_px, own = highest(slope_px, 1), slope_px, grey
    if lines.is_thin:
        near_px, start_px, own = run_side_by_side(
            lambda: thinned(near_px), lambda: thinned(slope_px), lambda: thinned(grey)
        )
    joined, variance, misfit = stitch(
        start_px,
        lines.slope_px,
        behind_jumps(start_px, near_px, information, 2.0 * step_px),
        own,
        radius_px=_STITCH_RADIUS_PX,
        stride_px=_STITCH_STRIDE_PX,
        slope_gate_px=slope_gate_px,
        grey_gate=scales.likeness,
        is_thin=lines.is_thin,
    )
    variance *= np.maximum(misfit, np.float32(1))
    if not lines.is_thin:
        return joined, variance
    return filled(
        joined, variance, start_px, own, slope_px, grey,
        slope_gate_px=slope_gate_px,
        grey_gate=scales.likeness,
    )  # fmt: skip
