"""From the images of one sample to its slopes: a pure function, so that `rig fit` can repeat it."""

import numpy as np

from rig.arrays import Float
from rig.epipolar import RectifiedViews
from rig.epipolar.board.dense import DenseBoardSlope, measure_dense
from rig.epipolar.board.fit import fit_board_slope
from rig.epipolar.board.slope import BoardSlope
from rig.errors import SlopeError, TargetError
from rig.frames import Pictures
from rig.measurement import Failure, Measurement, Point
from rig.optics.optics import Optics
from rig.optics.search_range import search_range_px
from rig.optics.target import target_of
from rig.profile import Profile
from rig.sweep.request import sweep_setup
from rig.targets import corners_or_reason


def measure_sample(profile: Profile, optics: Optics, images: Pictures) -> Measurement:
    """Measure the slope of the board in one multi-view, in all three ways.

    The corners give the unambiguous start, the joint line fit the slope, and the estimator that
    `rig capture` uses the dense slope, so that its bias is known. The same images give the same
    numbers to the last digit.

    Args:
        profile: the rig; it has a target.
        optics: of the rig.
        images: one per view, of any size, in the order of the profile's views.

    Returns:
        Slopes at the centre of the board; or why there are none.

    Raises:
        ConfigError: the profile gives distances, and the optics do not tell which slopes these are.
    """
    board = target_of(sweep_setup(profile).target)
    try:
        corners = [corners_or_reason(image, board) for image in images]
        slope = fit_board_slope(optics.board_views(images), corners)
    except TargetError as error:
        return Measurement(failure=Failure(error.reason, str(error)))
    except SlopeError as error:
        return Measurement(failure=Failure("no-slope", str(error)))
    views = optics.views(images)
    height, width = views.shape
    dense = _dense_slope(views, search_range_px(profile, optics), slope)
    return Measurement(
        slope_px=slope.slope_px,
        sigma_px=slope.sigma_px,
        plane=slope.plane,
        plane_sigma=_three(np.sqrt(np.diag(slope.plane_covariance))),
        centre_px=slope.centre_px,
        corner_slope_px=slope.corner_slope_px,
        corner_sigma_px=slope.corner_sigma_px,
        dense_slope_px=None if dense is None else dense.slope_px,
        dense_sigma_px=None if dense is None else dense.sigma_px,
        dense_pixel_sigma_px=None if dense is None else dense.pixel_sigma_px,
        corners_px=tuple(map(_points, slope.corners_px)),
        outline_px=_points(slope.outline_px),
        epipolar=slope.epipolar,
        track_residual_px=slope.track_residual_px,
        residual_levels=slope.residual,
        edge_pixels=slope.edge_pixels,
        views=tuple(profile.views[index].name for index in slope.views),
        across_px=tuple(map(tuple, slope.across_px.tolist())),
        size_px=(width, height),
    )


def _points(xy_px: Float) -> tuple[Point, ...]:
    """Places (N, 2)."""
    return tuple((x, y) for x, y in xy_px.tolist())


def _three(numbers: Float) -> tuple[float, float, float]:
    a, b, c = numbers.tolist()
    return a, b, c


def _dense_slope(
    views: RectifiedViews, slope_range_px: tuple[float, float], slope: BoardSlope
) -> DenseBoardSlope | None:
    """Return the slope that captures would see, None where they would see none.

    The curve does not need it; the report shows a gap.
    """
    try:
        return measure_dense(views, slope_range_px, slope)
    except SlopeError:
        return None
