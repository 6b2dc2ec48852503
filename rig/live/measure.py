"""From multi-views to depth, each the hypothesis for the next."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from rig.curve_rows import expecting_rows, require_same_rows, widened_by_rows
from rig.depth import DepthMap, depth_from_slopes
from rig.epipolar import Placement, RectifiedViews, SlopeMap, SlopePrior
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.usable import moving_views
from rig.errors import SlopeError
from rig.frames import ColourImage, GreyImage, MultiView
from rig.geometry.pinhole import Pinhole
from rig.live.frame import DepthFrame
from rig.live.frozen import frozen_views
from rig.live.processing import FrameProcessing
from rig.live.taking import Taken
from rig.stored import Run

_MOTION_PX = np.float32(0.2)
"""1 sigma of what a slope may change from one multi-view to the next and still be followed."""


@dataclass(frozen=True, slots=True, eq=False)
class Rectified:
    """A multi-view in the common frame."""

    taken: Taken
    views: RectifiedViews
    took_s: float
    """How long that took."""
    colour: ColourImage | None = None
    """(H, W, 3) of the reference view; None where its camera gives none."""


def rectified(run: Run, taken: Taken) -> Rectified:
    """Bring a multi-view into the common frame; any number of threads may do so.

    Raises:
        SlopeError: the pictures do not fit the calibration, or have no colour where the profile
            wants slopes of it.
    """
    begun_s = time.perf_counter()
    frames = taken.views.frames
    if run.profile.slopes.colour:
        views = run.optics.views(_colours(taken.views))
    else:
        views = run.optics.views(taken.views.images)
    colour = frames[views.reference].colour
    if colour is not None:
        colour = run.optics.reference_picture(colour)
    return Rectified(taken, views, time.perf_counter() - begun_s, colour)


def _colours(multiview: MultiView) -> list[ColourImage]:
    grey = [frame.view for frame in multiview.frames if frame.colour is None]
    if grey:
        raise SlopeError(
            f"asked for slopes of pictures in colour (slopes.colour), {', '.join(grey)} of "
            f"{len(multiview.frames)} views came in grey",
            advice="remove slopes.colour, or let the cameras give colour",
        )
    return [frame.colour for frame in multiview.frames if frame.colour is not None]


class DepthMeter:
    """Measures the multi-views of one opened camera, in their order.

    Rows and light that do not agree are measured in the first multi-view that is searched
    exhaustively, and mended in it and all that follow; rows start from what they missed by when the
    curve was made.

    Views that the first multi-view shows off the places that they are told to have are taken where
    they are from then on, with a warning.

    A view that repeats its last picture while others change is left out, with a warning.

    A curve that follows from a calibration alone becomes less sure by what rows miss by.

    Args:
        run: the rig; without a curve slopes are measured only.

    Raises:
        ConfigError: the profile gives distances, and nothing tells which slopes these are.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._depth_run = run
        self._range_px = run.range_px
        self._index = 0
        self._hypothesis: SlopePrior | None = None
        self._placement: Placement | None = None
        self._mending: Mending | None = None
        self._last: MultiView | None = None
        self._processing = FrameProcessing(run, lambda slopes: depth_of(self._depth_run, slopes))
        self._pinholes: dict[tuple[int, ...], Pinhole | None] = {}

    @property
    def run(self) -> Run:
        """The rig, its curve as sure as the pictures so far leave it."""
        return self._depth_run

    def measure(
        self, given: Rectified, *, follows: bool, on_slopes: Callable[[], None] = lambda: None
    ) -> DepthFrame:
        """Return slopes and, where the run has a curve, depth of one multi-view.

        Args:
            given: of the run's camera.
            follows: whether the scene is about where the multi-view before showed it. Its slopes
                are then the hypothesis: only their neighbourhood is searched, all of the range
                where they are contradicted or unknown. A scene that jumps is right again in the
                second multi-view after it.
            on_slopes: called once the slopes are known and only little is left to do.

        Raises:
            CurveError: rows miss otherwise than when the curve was made.
            SlopeError: the images give no slopes at all, or the reference view is frozen.
        """
        begun_s = time.perf_counter()
        run, multiview = self._run, given.taken.views
        count = len(multiview.frames)
        views = replace(expecting_rows(run, given.views), mending=self._mending)
        if self._placement is not None:
            views = views.placed(self._placement)
        views, warnings = moving_views(views, frozen_views(self._last, multiview))
        self._last = multiview
        hypothesis = self._hypothesis if follows else None
        found = self._processing.estimate(views, self._range_px, hypothesis)
        on_slopes()
        require_same_rows(run, found.mending)
        slopes = run.optics.answered(found)
        slopes = replace(slopes, warnings=warnings + slopes.warnings)
        if slopes.placement is not None and len(slopes.placement.steps) == count:
            self._placement = slopes.placement
        if slopes.mending is not None and len(slopes.mending.rows.fields) == count:
            if self._mending is not slopes.mending:
                self._depth_run = widened_by_rows(run, slopes.mending)
            self._mending = slopes.mending
        sigma_px = np.maximum(slopes.sigma_px, _MOTION_PX)
        self._hypothesis = SlopePrior(slopes.slope_px, sigma_px, slopes.steady)
        slopes = self._processing.joined(slopes, follows=follows)
        depth = depth_of(self._depth_run, slopes)
        ended_s = time.perf_counter()
        frame = DepthFrame(
            index=self._index,
            views=multiview,
            slopes=slopes,
            image=_picture(run, given.views, multiview),
            time_ns=given.taken.time_ns,
            latency_s=given.taken.age_s + ended_s - given.taken.handed_over_s,
            measuring_s=given.took_s + ended_s - begun_s,
            rig=run.profile.name,
            depth=depth,
            pinhole=self._pinhole(slopes.slope_px.shape),
            colour=given.colour,
        )
        self._index += 1
        return self._processing.finished(frame)

    def _pinhole(self, shape: tuple[int, ...]) -> Pinhole | None:
        if shape not in self._pinholes:
            self._pinholes = {shape: pinhole_of(self._run, shape)}
        return self._pinholes[shape]


def depth_of(run: Run, slopes: SlopeMap) -> DepthMap | None:
    """Return the depth of slopes by the run's curve; None where it has none."""
    if run.curve is None:
        return None
    on_axis = replace(slopes, slope_px=run.optics.axis_slopes_px(slopes.slope_px))
    max_sigma_pct = run.profile.quality.depth_sigma_pct
    return depth_from_slopes(on_axis, run.curve.curve, max_sigma_pct=max_sigma_pct)


def pinhole_of(run: Run, shape: tuple[int, ...]) -> Pinhole | None:
    """Return the camera that depth maps (H, W) of a run are seen by; None where it is unknown."""
    curve = None if run.curve is None else run.curve.curve
    # The slope law of a pinhole is f p / Z: its numerator tells the focal length.
    a_px_mm = None if curve is None else curve.params.get("a_px_mm")
    focal_px = None if a_px_mm is None else a_px_mm / run.profile.pitch_mm
    return run.optics.pinhole((shape[1], shape[0]), focal_px)


def _picture(run: Run, views: RectifiedViews, multiview: MultiView) -> GreyImage:
    """The reference view at the pixels of the maps, in the type that the camera gave it in."""
    taken = multiview.frames[views.reference].image
    if views.is_colour:
        return run.optics.reference_picture(taken)
    rectified = views.images[views.reference]
    if rectified.dtype == taken.dtype:
        return taken  # nothing was resampled
    top = np.iinfo(taken.dtype).max
    return cast("GreyImage", np.clip(np.rint(rectified), 0, top).astype(taken.dtype))
