"""The camera of a depth map and its points, against projection in closed form."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import CalibrationError, FormatError
from rig.geometry.pinhole import Pinhole
from rig.geometry.pose import Pose
from rig.live.measure import DepthMeter, rectified
from rig.live.taking import Taken
from rig.optics.calibrated import calibrated_optics
from rig.stored import Run
from rig.testing.simulated import BOARD_MM, open_simulated_rig
from tests.support.cameras import SMALL, SmallRig
from tests.support.geometry import true_geometry

TURN = Pose.from_vectors(np.array([0.02, -0.03, 0.01]), np.zeros(3)).rotation
CAMERA = Pinhole(40, 24, 50.0, (18.0, 13.0), TURN)


def test_points_lie_where_their_pixels_look_at_the_depth_that_was_asked_for():
    depth_mm = np.random.default_rng(3).uniform(400.0, 900.0, (24, 40)).astype(np.float32)
    depth_mm[5, 7] = np.nan
    points = CAMERA.points_mm(depth_mm)
    assert points.shape == (24, 40, 3)
    assert np.isnan(points[5, 7]).all()
    assert np.isnan(points).sum() == 3
    assert points[..., 2] == pytest.approx(depth_mm, nan_ok=True)
    in_common = points @ TURN.T
    seen = in_common @ CAMERA.matrix.T
    rows, columns = np.indices((24, 40))
    known = np.isfinite(depth_mm)
    assert (seen[..., 0] / seen[..., 2])[known] == pytest.approx(columns[known], abs=1e-6)
    assert (seen[..., 1] / seen[..., 2])[known] == pytest.approx(rows[known], abs=1e-6)


def test_a_map_of_another_size_is_refused():
    with pytest.raises(CalibrationError, match="40 x 23 px, the camera is of 40 x 24 px"):
        CAMERA.points_mm(np.ones((23, 40), np.float32))


def test_it_comes_back_from_json():
    again = Pinhole.from_json(json.loads(json.dumps(CAMERA.to_json())))
    assert (again.matrix == CAMERA.matrix).all()
    assert (again.common_from_reference == TURN).all()
    assert (again.width_px, again.height_px) == (40, 24)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=12,
)


@given(key=st.sampled_from(sorted(CAMERA.to_json())), value=JSON)
def test_whatever_stands_in_the_file_is_a_camera_or_refused(key: str, value: Any):
    content = {**CAMERA.to_json(), key: value}
    try:
        found = Pinhole.from_json(content)
    except FormatError:
        return
    assert np.isfinite(found.matrix).all()
    assert found.focal_px > 0.0


def test_without_a_calibration_the_curve_tells_the_focal_length():
    with open_simulated_rig() as camera:
        frame = camera.grab()
    height, width = frame.depth_mm.shape
    assert (height, width) == frame.image.shape == frame.label.shape == frame.sigma_mm.shape
    assert frame.camera.matrix[:2, :2] == pytest.approx(np.eye(2) * 152.5, rel=5e-3)
    assert frame.camera.matrix[:2, 2] == pytest.approx([(width - 1) / 2, (height - 1) / 2])
    board = (slice(25, 75), slice(40, 120))
    off_mm = np.abs(frame.depth_mm[board] - BOARD_MM)
    assert np.percentile(off_mm, 95.0) < 5.0
    assert np.median(off_mm / frame.sigma_mm[board]) < 1.0
    points = frame.points_mm()[board]
    assert np.isfinite(points).all()
    assert np.median(points[..., 2]) == pytest.approx(BOARD_MM, rel=2e-3)
    x_mm = (np.arange(40, 120) - 79.5) * BOARD_MM / 152.5
    assert np.median(points[..., 0], axis=0) == pytest.approx(x_mm, rel=0.01, abs=0.5)
    assert frame.colour is None


def test_with_a_calibration_picture_and_camera_are_those_of_the_rectified_view():
    small = SmallRig(name="sim-real", overrides=SMALL)
    geometry = true_geometry(small.profile, small.world.moment(0.0))
    optics = calibrated_optics(small.profile, geometry, 3)
    with small.camera() as camera:
        multiview = camera.grab(5.0)
    run = Run(small.profile, optics)
    taken = Taken(multiview, age_s=0.0, time_ns=5, handed_over_s=0.0)
    frame = DepthMeter(run).measure(rectified(run, taken), follows=False)
    reference = small.profile.reference
    assert frame.image.dtype == multiview.frames[reference].image.dtype
    assert (frame.image == optics.pictures(multiview.images)[reference]).all()
    common = optics.rectification.camera
    assert frame.camera.matrix.tolist() == [
        [common.fx_px, 0.0, common.cx_px],
        [0.0, common.fy_px, common.cy_px],
        [0.0, 0.0, 1.0],
    ]
    assert (frame.camera.common_from_reference == optics.rectification.common_from_reference).all()
    assert frame.time_ns == 5
