"""What was derived from the images of one sample."""

import math
from dataclasses import astuple, dataclass, fields, is_dataclass
from typing import cast

from rig.geometry.epipolar_error import EpipolarError

Point = tuple[float, float]
"""(x, y) in a picture."""


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a sample gave no slope."""

    reason: str
    """One word for programs, as in `TargetError.reason`."""
    message: str


@dataclass(frozen=True, slots=True)
class Measurement:
    """What was derived from one sample; `rig fit` replaces it.

    Places are in the rectified reference view.

    Raises:
        ValueError: a number is not finite; what is unknown is None.
    """

    slope_px: float | None = None
    """Slope at the centre of the board, px per view step: the joint line fit."""
    sigma_px: float | None = None
    plane: tuple[float, float, float] | None = None
    """(a, b, c) of m = a + b (u - u0) + c (v - v0) about `centre_px`: px, and px per px."""
    plane_sigma: tuple[float, float, float] | None = None
    """1 sigma of each of `plane`."""
    centre_px: Point | None = None
    """(u, v) of the centre of the board."""
    corner_slope_px: float | None = None
    """Slope from the tracks of the corners alone."""
    corner_sigma_px: float | None = None
    dense_slope_px: float | None = None
    """Slope of the dense estimator that `rig capture` uses."""
    dense_sigma_px: float | None = None
    dense_pixel_sigma_px: float | None = None
    """Median 1 sigma of one pixel of the board in the dense map; the two above are of the plane
    through all of them."""
    corners_px: tuple[tuple[Point, ...], ...] | None = None
    """Corners of the board, by row and column."""
    outline_px: tuple[Point, ...] | None = None
    """Four corners of the polygon within which edges belong to the board."""
    epipolar: EpipolarError | None = None
    """Of the corners of all other views, from the lines of the reference view's corners."""
    track_residual_px: float | None = None
    """Rms distance of the corners from their tracks."""
    residual_levels: float | None = None
    """Rms difference of the views from their common texture, grey levels."""
    edge_pixels: int | None = None
    """Pixels of the reference view that took part."""
    views: tuple[str, ...] = ()
    """Names of the views that took part."""
    across_px: tuple[tuple[float, ...], ...] | None = None
    """By how much the corners, row by row, lie across their lines in each of `views`."""
    size_px: tuple[int, int] | None = None
    """Width and height of the rectified reference view."""
    failure: Failure | None = None
    """Set when there is no slope."""

    def __post_init__(self) -> None:
        for place in fields(self):
            value: object = getattr(self, place.name)
            if not _all_finite(value):
                raise ValueError(f"{place.name} is {value}; leave what is unknown None")


def _all_finite(value: object) -> bool:
    if is_dataclass(value) and not isinstance(value, type):
        return _all_finite(astuple(value))
    if isinstance(value, tuple):
        return all(map(_all_finite, cast("tuple[object, ...]", value)))
    return not isinstance(value, float) or math.isfinite(value)
