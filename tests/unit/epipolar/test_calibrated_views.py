"""The board in the raw pictures of misaligned, distorting cameras whose calibration is true."""

import numpy as np
import pytest

from rig.epipolar.board.fit import fit_board_slope
from rig.errors import SlopeError
from rig.geometry.rectification import Rectification, rectify
from rig.optics.calibrated_views import CalibratedViews
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry

REAL = SmallRig(name="sim-real")
BOARD = Checkerboard(9, 6, 25.0)


@pytest.fixture(scope="module")
def rectification() -> Rectification:
    return rectify(true_geometry(REAL.profile, REAL.world.moment(0.0)), REAL.profile.pitch_mm)


@pytest.mark.slow
@pytest.mark.parametrize("position_mm", [430.0, 1150.0])
def test_the_cameras_alone_tell_the_depth_of_the_board(
    rectification: Rectification, position_mm: float
) -> None:
    REAL.slide.at_mm = position_mm - 1203.0
    with REAL.camera() as camera:
        images = camera.grab(1.0).images
    truth_mm = REAL.world.true_distance_mm(REAL.clock.now_s())
    views = CalibratedViews(images, rectification)
    found = fit_board_slope(views, [find_corners(image, BOARD) for image in images])
    centre = np.array(found.centre_px)
    slope_px = rectification.axis_slope_px(np.array(found.slope_px), centre)
    depth_mm = rectification.inverse_law_px_mm / (slope_px + rectification.infinity_px)
    assert float(depth_mm) == pytest.approx(truth_mm, rel=1e-4)
    # What is left beside the lines is the corners' own noise.
    assert found.track_residual_px < 0.02
    error = found.epipolar
    assert error.mean_px < error.p95_px < error.max_px < 0.1
    assert found.corners_px.shape == (6, 9, 2)


def test_the_lines_lead_into_the_pictures(rectification: Rectification) -> None:
    views = CalibratedViews(np.zeros((5, 400, 640), np.uint8), rectification)
    here = np.array([[200.0, 450.0], [120.0, 300.0]])
    none = np.zeros_like(here)
    slope_px = np.array([12.0, -5.0])
    raw = {view: views.places_px(view, here, slope_px, none).T for view in range(5)}
    common = views.common_px(raw)
    # Bent lines are made straight, by the slope that each point's own track tells.
    for view in range(5):
        straight = here - slope_px * np.array([[views.x_steps[view]], [views.y_steps[view]]])
        assert np.abs(common[view].T - straight).max() < 5e-3


@pytest.mark.parametrize("shape", [(4, 400, 640), (5, 200, 320)])
def test_other_pictures_than_calibrated_are_refused(
    rectification: Rectification, shape: tuple[int, int, int]
) -> None:
    with pytest.raises(SlopeError, match=r"the calibration is of 5 cameras of 640 x 400 px"):
        CalibratedViews(np.zeros(shape, np.uint8), rectification)
