"""What stands before the search: views that fit each other, in grey values of one noise."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.epipolar.mending.first_match import FirstMatch
from rig.epipolar.mending.fitting import fit_together
from rig.epipolar.mending.gains import Gains
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.usable import keep, strange_views
from rig.epipolar.noise.cross import measure_cross_noise
from rig.epipolar.noise.model import CrossNoise, NoiseModel
from rig.epipolar.placement.placement import on_their_lines
from rig.epipolar.sampling import pad
from rig.epipolar.scales import Grading, Scales, noise_of, stabilise
from rig.epipolar.search.cross_check import is_one_sided
from rig.epipolar.search.search import FEW, Effort, effort_of, wide_share
from rig.epipolar.search.window import Cameras, Window
from rig.epipolar.steady import Steady, Turn
from rig.epipolar.views import RectifiedViews

_MOST_UNTOLD = 0.98
"""Share of pixels without a hypothesis up to which one is taken for told."""
_TOLD_PREFILTER_PX = 0.6
"""Prefilter where a hypothesis tells the slopes. Splines through sharp clean edges lie beside them
between the pixels, by more than the noise. A search needs such pictures all the same: they tell
thin things and edges of slope, which a hypothesis does not look for."""


@dataclass(frozen=True, slots=True)
class Ready:
    """Views that can be compared, and what is known of them before slopes are searched."""

    images: NDArray[np.float32]
    """(V, H, W) grey values of one noise, prefiltered."""
    sharp: NDArray[np.float32]
    """(V, H, W) before the prefilter."""
    splines: NDArray[np.float32]
    """What `rig.epipolar.sampling.pad` makes of the images."""
    cameras: Cameras
    """Where the views stand."""
    scales: Scales
    """Grey scales of the images."""
    noise: CrossNoise
    """What the views differ by at the slopes of the first match, or as known."""
    mending: Mending
    """What was mended."""
    first: FirstMatch
    """The match that tells which pixels show the same."""
    effort: Effort
    """How slopes will be searched."""
    gains: Gains | None
    """Gain and offset of every view; None in colour, and where a view was left out by them."""
    grading: Grading
    """Where `scales` come from."""
    before: Steady | None
    """What the last multi-view told, where it belongs to these views and they are followed."""
    wide_share: float
    """Share of the pixels that the hypothesis does not know."""
    is_told: bool
    """Whether a hypothesis or a narrow range tells slopes somewhere, and no last frame."""
    warnings: tuple[str, ...]
    """What is to be said of the views."""

    def is_due(self, what: Turn) -> bool:
        """Whether something is to be measured and not taken from the last multi-view."""
        return self.before is None or self.before.is_due(what, self.wide_share)

    @property
    def is_one_sided(self) -> bool:
        """Whether no view has a counterpart on the other side, and slopes are searched anew."""
        return self.effort is not Effort.FOLLOWED and is_one_sided(self.cameras)


def prepare(
    seen: tuple[RectifiedViews, tuple[str, ...]],
    window: Window,
    noise: NoiseModel | None,
    rough_noise: CrossNoise | None,
    steady: Steady | None = None,
) -> Ready:
    """Make views fit each other, leave out those that do not, and measure their noise.

    Args:
        seen: views that show something, and what is to be said of the others (`seen_views`).
        window: the slopes to search.
        noise: noise of the grey values as told; None for that of the views, or what they show.
        rough_noise: what the views differ by; None to measure it at the first match.
        steady: what the last multi-view told that hardly changes; None for nothing.

    Raises:
        SlopeError: no view but the reference can be used.
    """
    views, warnings = seen
    known = noise or views.noise
    grey_step = 0.0 if views.images.dtype == np.float32 else 1.0
    steady, wide, effort = _of_these(steady, views, window)
    gains = None if steady is None or steady.is_due(Turn.GAINS, wide) else steady.gains
    fitted = fit_together(views, window, grey_step, known, gains)
    if views.is_colour:
        known, grey_step = None, 0.0
    images, mending = fitted.images, fitted.mending
    strange, more = strange_views(views, fitted.agreement)
    if strange.any():
        views, images, warnings = keep(views, ~strange), images[~strange], warnings + more
        mending = mending.kept(~strange)
    warnings += mending.warnings(views.x_steps, views.y_steps)
    cameras = Cameras(views.x_steps, views.y_steps, views.reference)
    if strange.any():
        effort = effort_of(cameras, window)
    cross = mending.noise or rough_noise
    if cross is None and effort is Effort.FOLLOWED:
        cross = CrossNoise()
    if steady is None or steady.is_due(Turn.NOISE, wide):
        model = noise_of(images, grey_step, known)
        if cross is None:
            cross = measure_cross_noise(images, cameras, fitted.rough_slope_px, model)
        model = model.raised(cross.excess)
        images, grading = stabilise(images, views.reference, model, is_told=known is not None)
    else:
        cross, grading = cross or CrossNoise(), steady.grading
        images = grading.of(images)
    is_told = steady is None and not views.is_colour and wide < _MOST_UNTOLD
    scales = replace(
        grading.scales,
        misfit_px=cross.misfit_px,
        is_alike=cross.excess > 1,
        least_prefilter_px=_TOLD_PREFILTER_PX if is_told else 0.0,
    )
    if views.beside_px is not None:
        images = on_their_lines(images, views.beside_px)
    smooth = _smoothed(images, scales.prefilter_px)
    splines = pad(smooth, cameras.x_steps, cameras.y_steps)
    return Ready(
        smooth, images, splines, cameras, scales, cross, mending, fitted.first, effort,
        None if strange.any() else fitted.gains, grading, steady, wide, is_told,
        warnings,
    )  # fmt: skip


def _of_these(
    steady: Steady | None, views: RectifiedViews, window: Window
) -> tuple[Steady | None, float, Effort]:
    """What the last multi-view told, if it belongs to these views and they are followed.

    Also the share of the unknown, and how slopes are to be searched. What was unknown before, and
    was searched then, is no reason to search everything.
    """
    cameras = Cameras(views.x_steps, views.y_steps, views.reference)
    wide, few = wide_share(window, cameras), FEW
    if views.is_colour or steady is None or not steady.is_of(views.x_steps, views.y_steps):
        steady = None
    else:
        few = max(FEW, steady.most_followed)
    effort = effort_of(cameras, window, wide, few)
    return (steady if effort is Effort.FOLLOWED else None), wide, effort


def closer_noise(ready: Ready, slope_px: NDArray[np.float32]) -> CrossNoise:
    """Measure what views differ by once more, at slopes (H, W) that are known better.

    Args:
        ready: the views.
        slope_px: px per view step.
    """
    white = NoiseModel(ready.scales.noise, step_levels=0.0)
    closer = measure_cross_noise(ready.sharp, ready.cameras, slope_px, white)
    return replace(closer, ratio=closer.ratio * ready.noise.excess)


def _smoothed(images: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    """Prefilter images (V, H, W)."""
    if sigma_px == 0:
        return images
    smooth = np.empty_like(images)

    def work(start: int, stop: int) -> None:
        for image, target in zip(images[start:stop], smooth[start:stop], strict=True):
            cv2.GaussianBlur(image, (0, 0), sigma_px, dst=target)

    run_in_bands(work, len(images))
    return smooth
