"""What the profile says is to be done to the slopes and the depth of live frames."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np

from rig.depth import DepthMap
from rig.depth.processing.decimation import decimated, decimated_picture
from rig.depth.processing.holes import filled
from rig.depth.processing.region import Region, estimate_around
from rig.depth.processing.temporal import SlopeFilter
from rig.epipolar import Label, RectifiedViews, SlopeMap, SlopePrior, estimate_slopes
from rig.frames import ColourImage, GreyImage
from rig.live.frame import DepthFrame
from rig.stored import Run

_JUMP_PX = 0.6
"""Neighbours that differ by more in the outermost view belong to two surfaces."""


class FrameProcessing:
    """Processes the frames of one opened camera, in their order.

    Args:
        run: its profile says what is done.
        depth_of: depth of slopes; None where the run has no curve.
    """

    def __init__(self, run: Run, depth_of: Callable[[SlopeMap], DepthMap | None]) -> None:
        self._config = run.profile.processing
        self._depth_of = depth_of
        frames = self._config.temporal_frames
        self._filter = SlopeFilter(frames) if frames else None
        self._region = None if self._config.roi_px is None else Region(*self._config.roi_px)
        reach = np.hypot(run.optics.x_steps, run.optics.y_steps)
        self._jump_px = _JUMP_PX / float(reach.max())

    def estimate(
        self, views: RectifiedViews, range_px: tuple[float, float], prior: SlopePrior | None
    ) -> SlopeMap:
        """Estimate slopes where they are wanted; elsewhere there is no answer.

        Raises:
            ConfigError: the region of interest leaves the pictures.
            SlopeError: see `estimate_slopes`.
        """
        if self._region is None:
            return estimate_slopes(views, range_px, prior)
        return estimate_around(self._region, views, range_px, prior)

    def joined(self, slopes: SlopeMap, *, follows: bool) -> SlopeMap:
        """Return slopes joined with those before.

        Args:
            slopes: as measured.
            follows: whether they are of the multi-view next to the last.
        """
        if self._filter is None:
            return slopes
        if not follows:
            self._filter.forget()
        return self._filter.filtered(slopes)

    def finished(self, frame: DepthFrame) -> DepthFrame:
        """Return a frame with holes filled, cut to its region and decimated."""
        begun_s = time.perf_counter()
        before = frame
        if self._config.fill_px:
            answered = frame.label != Label.NONE
            slopes = filled(frame.slopes, answered, self._config.fill_px)
            frame = replace(frame, slopes=slopes, depth=self._depth_of(slopes))
        if self._region is not None:
            frame = cut(frame, self._region)
        if self._config.decimation > 1:
            frame = _decimated(frame, self._config.decimation, self._jump_px)
        if frame is before:
            return frame
        took_s = time.perf_counter() - begun_s
        return replace(
            frame,
            latency_s=frame.latency_s + took_s,
            measuring_s=frame.measuring_s + took_s,
        )


def cut(frame: DepthFrame, region: Region) -> DepthFrame:
    """Return the part of a frame that is in a region, with the camera that sees it."""
    part = region.of
    slopes, depth, pinhole = frame.slopes, frame.depth, frame.pinhole
    return replace(
        frame,
        image=part(frame.image),
        colour=None if frame.colour is None else part(frame.colour),
        slopes=replace(
            slopes,
            slope_px=part(slopes.slope_px),
            sigma_px=part(slopes.sigma_px),
            label=part(slopes.label),
        ),
        depth=None
        if depth is None
        else DepthMap(part(depth.depth_mm), part(depth.sigma_mm), part(depth.label)),
        pinhole=None
        if pinhole is None
        else pinhole.cut(region.x_px, region.y_px, (region.width_px, region.height_px)),
    )


def _decimated(frame: DepthFrame, factor: int, jump_px: float) -> DepthFrame:
    slopes, depth = decimated(frame.slopes, frame.depth, factor, jump_px)
    return replace(
        frame,
        slopes=slopes,
        depth=depth,
        image=cast("GreyImage", decimated_picture(frame.image, factor)),
        colour=None if frame.colour is None else _decimated_colour(frame.colour, factor),
        pinhole=None if frame.pinhole is None else frame.pinhole.decimated(factor),
    )


def _decimated_colour(colour: ColourImage, factor: int) -> ColourImage:
    channels = [decimated_picture(colour[..., c], factor) for c in range(3)]
    return np.stack(channels, axis=-1).astype(np.uint8)
