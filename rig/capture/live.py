"""Live metric depth: slopes of every multi-view, turned into distance by the rig's curve."""

import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from rig.capture.frozen import frozen_views
from rig.curve_rows import expecting_rows, require_same_rows
from rig.depth import DepthMap, depth_from_slopes
from rig.devices import Camera
from rig.epipolar import Placement, SlopeMap, SlopePrior, estimate_slopes
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.usable import moving_views
from rig.frames import MultiView
from rig.stored import Run

_MOTION_PX = np.float32(0.2)
"""1 sigma of what a slope may change from one multi-view to the next and still be followed."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One multi-view with its slopes and, where a curve is known, its depth."""

    index: int
    multiview: MultiView
    slopes: SlopeMap
    depth: DepthMap | None
    latency_s: float
    """From the moment the camera handed the multi-view over until its depth was ready."""

    @property
    def valid_share(self) -> float:
        """Share of the pixels with an answer: a depth where a curve is known, else a slope."""
        label = self.slopes.label if self.depth is None else self.depth.label
        return float((label > 0).mean())

    def line(self) -> str:
        """Say for a person how it went."""
        valid_pct = 100.0 * self.valid_share
        return f"answer at {valid_pct:.1f} % of the pixels, {1e3 * self.latency_s:.0f} ms"


@dataclass(slots=True)
class CaptureTally:
    """What a capture did, frame by frame."""

    latencies_s: list[float] = field(default_factory=list)
    skews_s: list[float] = field(default_factory=list)
    valid_shares: list[float] = field(default_factory=list)
    skewed: int = 0
    """Multi-views left out because their views were too far apart in time."""

    def add(self, measured: Measured) -> None:
        """Count one measured multi-view."""
        self.latencies_s.append(measured.latency_s)
        self.skews_s.append(measured.multiview.skew_s)
        self.valid_shares.append(measured.valid_share)

    @property
    def valid_pct(self) -> float:
        """Mean share of pixels with an answer, per cent; NaN before the first frame."""
        return 100.0 * statistics.fmean(self.valid_shares) if self.valid_shares else float("nan")


def run_capture(run: Run, camera: Camera, tally: CaptureTally) -> Iterator[Measured]:
    """Yield slopes of every multi-view that the camera streams, and depth where there is a curve.

    The slopes of one multi-view are the hypothesis for the next: only their neighbourhood is
    searched, all of the range where they are contradicted or unknown. A scene that jumps is right
    again in the second multi-view after it.

    Rows and light that do not agree are measured in the first multi-view that is searched
    exhaustively, and mended in it and all that follow; rows start from what they missed by when the
    curve was made.

    Views that the first multi-view shows off the places that they are told to have are taken where
    they are from then on, with a warning.

    A view that repeats its last picture while others change is left out, with a warning.

    Skewed multi-views are dropped and counted: a moving scene seen at different times gives
    slopes that no distance explains.

    Raises:
        CurveError: rows miss otherwise than when the curve was made.
        DeviceError: the camera failed.
        SlopeError: the images give no slopes at all, or the reference view is frozen.
    """
    profile, optics = run.profile, run.optics
    index = 0
    hypothesis: SlopePrior | None = None
    placement: Placement | None = None
    mending: Mending | None = None
    last: MultiView | None = None
    for multiview in camera.stream():
        begun_s = time.perf_counter()
        if multiview.skew_s > profile.camera.max_skew_s:
            tally.skewed += 1
            continue
        views = optics.views([frame.image for frame in multiview.frames])
        views = replace(expecting_rows(run, views), mending=mending)
        if placement is not None:
            views = views.placed(placement)
        views, warnings = moving_views(views, frozen_views(last, multiview))
        last = multiview
        slopes = optics.answered(estimate_slopes(views, profile.slopes.range_px, hypothesis))
        require_same_rows(run, slopes.mending)
        slopes = replace(slopes, warnings=warnings + slopes.warnings)
        if slopes.placement is not None and len(slopes.placement.steps) == len(multiview.frames):
            placement = slopes.placement
        if slopes.mending is not None and len(slopes.mending.rows.fields) == len(multiview.frames):
            mending = slopes.mending
        hypothesis = SlopePrior(slopes.slope_px, np.maximum(slopes.sigma_px, _MOTION_PX))
        depth = None
        if run.curve is not None:
            on_axis = replace(slopes, slope_px=optics.axis_slopes_px(slopes.slope_px))
            max_sigma_pct = profile.quality.depth_sigma_pct
            depth = depth_from_slopes(on_axis, run.curve.curve, max_sigma_pct=max_sigma_pct)
        measured = Measured(index, multiview, slopes, depth, time.perf_counter() - begun_s)
        tally.add(measured)
        index += 1
        yield measured
