"""The dense slope estimator: from rectified views to slope, sigma and label of every pixel."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_both
from rig.epipolar.chessboard import doubled, thinned
from rig.epipolar.confidence import Evidence, contradicted, judge
from rig.epipolar.contest import contested
from rig.epipolar.drift import local_drift, variance_of_slopes
from rig.epipolar.in_turn import broad_drift, handed_on, known_rivals, pooled_in_turn
from rig.epipolar.line import LineFits
from rig.epipolar.median import settle_edges
from rig.epipolar.mending.usable import seen_views
from rig.epipolar.noise.local import reply_share
from rig.epipolar.noise.model import CrossNoise, NoiseModel
from rig.epipolar.occlusion import hidden_points
from rig.epipolar.placement.fit import find_placement
from rig.epipolar.placement.placement import Placement, on_their_lines
from rig.epipolar.plain import has_coarse_texture
from rig.epipolar.prepare import Ready, closer_noise, prepare
from rig.epipolar.rank import quantile
from rig.epipolar.refine import FAR, NEAR, Stitched, refine
from rig.epipolar.sampling import pad
from rig.epipolar.search.cross_check import is_one_sided
from rig.epipolar.search.found import Found
from rig.epipolar.search.pair import PAIR_ERROR_PX
from rig.epipolar.search.search import Effort, search
from rig.epipolar.search.sides import choose_sides
from rig.epipolar.search.window import LABEL_SHIFT_PX, Cameras, Window, window_of
from rig.epipolar.steady import Steady
from rig.epipolar.unconfirmed import is_confirmed, unconfirmed_variance
from rig.epipolar.views import RectifiedViews, SlopeMap, SlopePrior

_FEWEST_THIN = 3
"""Views from which on every second pixel of a followed frame will do."""

_MEDIAN_ROUNDS = {Effort.FOLLOWED: 1, Effort.COARSE: 1, Effort.FULL: 2}
"""One where the edges have been settled before: in the last frame, at half size."""
_JUMP_LABELS = 3.0
"""A pixel whose window is narrower than this cannot change to the other side of a jump."""
_MUCH_LESS = 0.8
"""Noise at the slopes found over that of the first match, from which the first match was wrong."""
_START_LABELS = 0.15
"""Error of the slopes before the line fit, in labels, 1 sigma."""
_FROM_ROWS = 0.5
"""Error along a line over that across it: slanted edges turn one into the other."""


_KNOWN_LABELS, _SURPRISE = 8.0, 0.5
"""Width of a window that a hypothesis is sure of; and share of such pixels that the views must
contradict for it to be wrong altogether."""
_FEW = 0.05
"""Share of the pixels at either end of the slopes that do not count as their spread."""
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
    window, seen = run_both(
        lambda: window_of(views.shape, slope_range_px, prior), lambda: seen_views(views)
    )
    steady = None if prior is None else prior.steady
    return _estimate(seen, window, slope_range_px, noise, None, steady, trust_places=trust_places)


def _estimate(
    seen: tuple[RectifiedViews, tuple[str, ...]],
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
        seen: the views that show something, and what is to be said of the others.
        window: the slopes to search.
        slope_range_px: lowest and highest of them.
        noise: as told.
        rough_noise: what the views differ by; None to measure it at the first match.
        steady: what the last multi-view told beside its slopes; None to measure it.
        trust_places: whether the views are where they are told to be.
    """
    ready = prepare(seen, window, noise, rough_noise, steady)
    cameras, scales, mending = ready.cameras, ready.scales, ready.mending
    images, splines, grey = ready.images, ready.splines, ready.images[ready.cameras.reference]
    broad = drift = broad_drift(ready, window)
    found = search(
        images, cameras, window, scales, splines, drift, known_rivals(ready), ready.effort
    )
    movable = window.is_wider(_JUMP_LABELS * cameras.step_px)
    edged = settle_edges(
        window.hold(found.slope_px), grey, movable,
        jump_px=1.5 * cameras.step_px,
        grey_scale=1.4 * scales.likeness,
        rounds=_MEDIAN_ROUNDS[ready.effort],
    )  # fmt: skip
    edged = window.hold(edged)
    if ready.effort is Effort.COARSE or ready.is_one_sided:
        nowhere = np.zeros(images.shape, np.bool_)
        _, (joined, _) = refine(images, splines, edged, nowhere, cameras, scales, drift, FAR)
        first_slope = window.hold(_within_reach(edged, joined, ready))
    else:
        first_slope = edged
    if mending.noise is None and ready.effort is not Effort.FOLLOWED:
        closer = closer_noise(ready, first_slope)
        was_wrong = closer.ratio < _MUCH_LESS * ready.noise.excess
        if rough_noise is None and ready.noise.excess > 1 and was_wrong:
            own = CrossNoise()  # what single pictures tell
            return _estimate(
                seen, window, slope_range_px, noise, own, None, trust_places=trust_places
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
    step = partial(
        refine, images, splines, covered=covered, cameras=cameras, scales=scales, drift=drift,
        is_thin=is_thin,
    )  # fmt: skip
    lines, (stitched, variance), start_labels = _stepped(step, sided, ready, window)
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
        lines, (stitched, variance) = refine(
            placed, placed_splines, slope, covered, placed_cameras, scales, drift
        )
        slope = window.hold(stitched)
    else:
        placement, placed_cameras, placed_splines = None, cameras, splines
    rival_px = found.rival_px
    (against, pooled), holds_out = run_both(
        lambda: (contradicted(lines), pooled_in_turn(ready, cross)),
        lambda: contested(placed_splines, slope, rival_px, placed_cameras, scales, grey, drift),
    )
    variance *= np.float32(pooled)
    np.copyto(rival_px, np.float32(np.nan), where=~holds_out)
    if drift_variance is not None:
        drift_variance = variance_of_slopes(drift_variance, grey, placed_cameras)
    misfit_px = _FROM_ROWS * mending.rows.scatter_px
    start_px, coarse_texture = start_labels * LABEL_SHIFT_PX, None
    if is_one_sided(placed_cameras):
        # What two views miss each other by, neighbours share, and no third one tells.
        misfit_px, start_px = float(np.hypot(misfit_px, cross.misfit_px)), PAIR_ERROR_PX
        is_row = bool(np.abs(cameras.x_steps).max() >= np.abs(cameras.y_steps).max())
        centre = ready.sharp[cameras.reference]
        coarse_texture = has_coarse_texture(centre, scales, is_row=is_row)
    confirmed, open_variance = _confirmation(ready, found, against, slope, placed_cameras)
    per_shift = placed_cameras.step_px / LABEL_SHIFT_PX
    evidence = Evidence(
        lines=lines,
        variance=variance,
        against=against,
        views=len(images),
        misfit_px=misfit_px * per_shift,
        hidden=hidden,
        unshared=found.unshared,
        start_px=start_px * per_shift,
        rival_px=rival_px,
        drift_variance=drift_variance,
        unconfirmed_variance=open_variance,
        confirmed=confirmed,
        coarse_texture=coarse_texture,
        is_misled=ready.effort is Effort.FOLLOWED
        and _is_misled(against, window, placed_cameras, is_thin=lines.is_thin),
    )
    judged = judge(slope, evidence, placed_cameras.step_px, slope_range_px, warnings)
    judged = _with_doubt_of(places, judged, slope_range_px[1] - slope_range_px[0])
    # Around a hypothesis nothing is looked for: what is not known then is not known to be right.
    is_looked_for = seen[0].mending is not None or ready.effort is not Effort.FOLLOWED
    return replace(
        judged,
        placement=placement,
        mending=mending if is_looked_for else None,
        steady=handed_on(ready, pooled, broad, rival_px, slope),
    )


def _stepped(
    step: Callable[..., tuple[LineFits, Stitched]],
    slope_px: NDArray[np.float32],
    ready: Ready,
    window: Window,
) -> tuple[LineFits, Stitched, float]:
    """Step from the slopes (H, W) of a search, or of the last frame, to the lines.

    One step keeps a part of the search's error, which follows the place between the pixels. Where
    the slopes of a picture take its views to all such places, that averages out; where they do not,
    as between the views of one lens, all pixels share it, and there is a second step.

    Also returns the error of what the last step began with, in labels, 1 sigma.
    """
    is_searched = ready.effort is Effort.FULL or ready.is_told
    lines, stitched = step(slope_px=slope_px, found=NEAR if is_searched else None)
    if is_searched and (ready.is_told or _is_one_place(stitched[0], ready.cameras)):
        left = _START_LABELS * (1.0 - reply_share(lines, ready.scales))
        begun = window.hold(_within_reach(slope_px, stitched[0], ready))
        return *step(slope_px=begun), left
    return lines, stitched, _START_LABELS


def _is_one_place(slope_px: NDArray[np.float32], cameras: Cameras) -> bool:
    """Whether slopes (H, W) take the outermost view to less than all places between pixels."""
    some = slope_px[::4, ::4].ravel()
    spread_px = quantile(some, 1.0 - _FEW) - quantile(some, _FEW)
    return spread_px * LABEL_SHIFT_PX / cameras.step_px < 1.0


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


def _confirmation(
    ready: Ready,
    found: Found,
    against: NDArray[np.bool_],
    slope_px: NDArray[np.float32],
    cameras: Cameras,
) -> tuple[NDArray[np.bool_] | None, NDArray[np.float32] | None]:
    """Where a search from the other end shares slopes (H, W), and the variance that it leaves open.

    None where there was no such search.
    """
    if not ready.is_one_sided:
        return None, None
    return is_confirmed(found), unconfirmed_variance(found, slope_px, against, cameras)


def _is_misled(
    against: NDArray[np.bool_], window: Window, cameras: Cameras, *, is_thin: bool
) -> bool:
    """Whether the views contradict a good share of the slopes that were taken for known.

    The scene has jumped then, and the hypothesis is no guide: what agrees with it does so by
    chance. What the hypothesis called unsure itself does not count: a mirror contradicts every
    frame.
    """
    known = ~window.is_wider(_KNOWN_LABELS * cameras.step_px)
    if is_thin:
        known = thinned(known)
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
