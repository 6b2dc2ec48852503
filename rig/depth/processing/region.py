"""A region of interest: only what it needs of the pictures is searched."""

import math
from dataclasses import dataclass, replace
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar import RectifiedViews, SlopeMap, SlopePrior, estimate_slopes
from rig.epipolar.mending.cropped import cropped_rows
from rig.errors import ConfigError

_Map = TypeVar("_Map", bound=NDArray[np.generic])
_ROOM_PX = 24
"""Around what a slope is told by: windows of the search, of its edges and of stitching."""


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of whole pixels."""

    x_px: int
    """First column."""
    y_px: int
    """First row."""
    width_px: int
    height_px: int

    def of(self, values: _Map) -> _Map:
        """Return the part of a map (H, W) that is inside."""
        rows = slice(self.y_px, self.y_px + self.height_px)
        return cast("_Map", values[rows, self.x_px : self.x_px + self.width_px])

    def require_inside(self, shape: tuple[int, ...]) -> None:
        """Refuse a region that leaves maps of a shape (H, W).

        Raises:
            ConfigError: it does.
        """
        height, width = shape
        if self.x_px + self.width_px > width or self.y_px + self.height_px > height:
            raise ConfigError(
                f"region of {self.width_px} x {self.height_px} px at ({self.x_px}, {self.y_px}) "
                f"asked for, the maps are of {width} x {height} px",
                advice="choose processing.roi_px inside them",
            )

    def around(self, views: RectifiedViews, range_px: tuple[float, float]) -> "Region":
        """Return the part of the pictures that shows its points at every slope of a range."""
        height, width = views.shape
        x0, x1 = _reach(self.x_px, self.width_px, views.x_steps, range_px, width)
        y0, y1 = _reach(self.y_px, self.height_px, views.y_steps, range_px, height)
        return Region(x0, y0, x1 - x0, y1 - y0)


def _reach(
    first: int, length: int, steps: Float, range_px: tuple[float, float], size: int
) -> tuple[int, int]:
    moves_px = -np.outer(steps, range_px)
    low = first + math.floor(float(moves_px.min())) - _ROOM_PX
    high = first + length + math.ceil(float(moves_px.max())) + _ROOM_PX
    return max(low, 0), min(high, size)


def estimate_around(
    region: Region,
    views: RectifiedViews,
    range_px: tuple[float, float],
    prior: SlopePrior | None,
) -> SlopeMap:
    """Estimate slopes in a region; around it only what falls off, and nothing elsewhere.

    Placement and mending are found in this part of the pictures; mending of the last multi-view
    must be of the same part, rows that are known from a sweep are of the whole pictures.

    Args:
        region: inside the pictures.
        views: as for `estimate_slopes`.
        range_px: as for `estimate_slopes`.
        prior: of the size of the pictures.

    Returns:
        Slopes of the size of the pictures, without an answer outside.

    Raises:
        ConfigError: the region leaves the pictures.
        SlopeError: see `estimate_slopes`.
    """
    region.require_inside(views.shape)
    part = region.around(views, range_px)
    rows = views.row_errors
    if rows is not None:
        rows = cropped_rows(rows, part.x_px, part.y_px, (part.height_px, part.width_px))
    images = np.stack([part.of(image) for image in views.images])
    if prior is not None:
        slope_px = np.ascontiguousarray(part.of(prior.slope_px))
        sigma_px = np.ascontiguousarray(part.of(prior.sigma_px))
        prior = replace(prior, slope_px=slope_px, sigma_px=sigma_px)
    found = estimate_slopes(replace(views, images=images, row_errors=rows), range_px, prior)
    nothing = np.full(views.shape, np.nan, np.float32)
    whole = replace(
        found,
        slope_px=nothing,
        sigma_px=nothing.copy(),
        label=np.zeros(views.shape, np.uint8),
    )
    for target, values in (
        (whole.slope_px, found.slope_px),
        (whole.sigma_px, found.sigma_px),
        (whole.label, found.label),
    ):
        part.of(target)[...] = values
    return whole
