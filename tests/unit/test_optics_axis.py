"""Optics of a rig whose common frame is turned: every answer from the rotation itself."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rectification import Rectification
from rig.geometry.rig_geometry import RigGeometry, StageGeometry
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.optics.nominal import NominalOptics
from tests.support.cameras import SMALL, SmallRig
from tests.support.geometry import true_geometry

TURN = Pose.from_vectors(np.array([0.11, -0.07, 0.05]), np.zeros(3)).rotation
FX_PX, MIDDLE_PX, M0_PX = 500.0, (70.0, 45.0), 31.0
CAMERAS = (
    CameraModel(160, 100, 510.0, 490.0, 80.0, 50.0, "brown5", (0.0,) * 5),
    CameraModel(160, 100, 400.0, 800.0, 80.0, 50.0),
    CameraModel(160, 100, 505.0, 495.0, 80.0, 50.0),
)
POSES = tuple(Pose(np.eye(3), np.array([-40.0 * k, 0.0, 0.0])) for k in (-1, 0, 1))


def optics(**changes: object) -> CalibratedOptics:
    geometry = RigGeometry(("a", "b", "c"), 1, CAMERAS, POSES)
    rectification = Rectification(
        geometry=replace(geometry, **changes),  # pyright: ignore[reportArgumentType]
        camera=CameraModel(160, 100, FX_PX, FX_PX, *MIDDLE_PX),
        common_from_reference=TURN,
        x_steps=np.array([-1.0, 0.0, 1.0]),
        y_steps=np.zeros(3),
        z_steps=np.array([1e-5, 0.0, -2e-5]),
        infinity_px=M0_PX,
        pitch_mm=40.0,
    )
    return CalibratedOptics(rectification, 1)


def ratio(x: Float, y: Float) -> Float:
    """Depth in the reference camera's frame over that in the common one, and 1 on its axis."""
    ray = np.stack([(x - MIDDLE_PX[0]) / FX_PX, (y - MIDDLE_PX[1]) / FX_PX, np.ones_like(x)])
    return np.einsum("c,c...->...", TURN[:, 2], ray) * TURN[2, 2]


def test_the_axis_is_where_the_reference_camera_looks() -> None:
    forward = TURN @ np.array([0.0, 0.0, 1.0])
    expected = MIDDLE_PX + FX_PX * forward[:2] / forward[2]
    assert optics().axis_px == pytest.approx(tuple(expected))
    found = optics().rectification.depth_ratio(np.array(optics().axis_px)[:, None])
    assert found == pytest.approx([1.0], abs=1e-12)


def test_slopes_on_the_axis_are_divided_by_the_ratio_of_depths() -> None:
    rows, columns = np.indices((100, 160), dtype=np.float64)
    slopes = (3.0 + 0.01 * columns - 0.02 * rows).astype(np.float32)
    found = optics().axis_slopes_px(slopes)
    expected = (slopes + M0_PX) / ratio(columns, rows) - M0_PX
    assert found.dtype == np.float32
    assert found == pytest.approx(expected, abs=2e-5)


def test_a_plane_on_the_axis_has_the_derivatives_of_that() -> None:
    a, b, c = 3.0, 0.01, -0.02
    x, y = 120.0, 20.0
    step = 1e-3

    def at(right: float, down: float) -> float:
        slope = a + b * right + c * down
        return float((slope + M0_PX) / ratio(np.array(x + right), np.array(y + down)) - M0_PX)

    found = optics().axis_plane((a, b, c), (x, y))
    expected = (
        at(0.0, 0.0),
        (at(step, 0.0) - at(-step, 0.0)) / (2 * step),
        (at(0.0, step) - at(0.0, -step)) / (2 * step),
    )
    assert found == pytest.approx(expected, rel=1e-6)


def test_rays_and_directions_are_turned_into_the_reference_camera() -> None:
    pixel = (120.0, 20.0)
    ray = TURN.T @ np.array([50.0 / FX_PX, -25.0 / FX_PX, 1.0])
    assert optics().ray(pixel, 12345.0) == pytest.approx(ray[:2] / ray[2], abs=1e-15)
    found = optics().reference_directions(np.array([2.0, 3.0]))
    assert found == pytest.approx((TURN.T @ np.array([2.0, 3.0, 0.0]))[:2], abs=1e-15)
    pinhole = optics().pinhole((1, 1), None)
    assert (pinhole.width_px, pinhole.height_px, pinhole.focal_px) == (160, 100, FX_PX)
    assert pinhole.principal_point_px == MIDDLE_PX
    assert np.array_equal(pinhole.common_from_reference, TURN)


def test_the_stage_of_the_calibration_makes_distances() -> None:
    assert optics().distance_mm(412.5) == 412.5
    axis = np.array([0.6, 0.0, 0.8])
    stage = StageGeometry(axis, 1.25, 30.0, np.eye(4))
    assert optics(stage=stage).distance_mm(412.5) == pytest.approx(30.0 + 412.5)
    stage = StageGeometry(axis, 2.0, -30.0, np.eye(4))
    assert optics(stage=stage).distance_mm(100.0) == pytest.approx(130.0)


def test_the_axis_is_as_sure_as_the_reference_cameras_middle() -> None:
    assert optics().axis_variance_rad2.tolist() == [0.0, 0.0]
    # Nine numbers of the first camera, four of each other, twelve of two places.
    covariance = np.diag(np.arange(29.0))
    found = optics(covariance=covariance).axis_variance_rad2
    assert found == pytest.approx([11.0 / 400.0**2, 12.0 / 800.0**2])


def test_the_inverse_law_and_the_focus_are_those_of_the_turned_frame() -> None:
    rectification = optics().rectification
    assert rectification.inverse_law_px_mm == pytest.approx(FX_PX * 40.0 / TURN[2, 2])
    assert rectification.focus_mm == pytest.approx(FX_PX * 40.0 / TURN[2, 2] / M0_PX)
    assert replace(rectification, infinity_px=0.0).focus_mm == np.inf
    assert rectification.shape == (100, 160)
    assert rectification.centre_px.tolist() == [70.0, 45.0]
    for view, step, z in ((0, -1.0, 1e-5), (2, 1.0, -2e-5)):
        seen = rectification.view_camera(view)
        assert seen.fx_px == seen.fy_px == pytest.approx(FX_PX * (1 - M0_PX * z))
        assert (seen.cx_px, seen.cy_px) == pytest.approx((70.0 + M0_PX * step, 45.0))


def test_lines_are_those_of_two_pinholes() -> None:
    """A point of the common frame at its depth, seen by the views as they are rectified."""
    rectification = optics().rectification
    point = np.array([30.0, -20.0, 640.0])
    pixel = FX_PX * point[:2] / point[2] + MIDDLE_PX
    slope = FX_PX * 40.0 / point[2] - M0_PX
    for view, step in ((0, -1.0), (1, 0.0), (2, 1.0)):
        place = np.array([40.0 * step, 0.0, rectification.z_steps[view] * FX_PX * 40.0])
        seen = rectification.view_camera(view).project((point - place)[None])[0]
        line = rectification.line_px(view, pixel[:, None], np.array([slope]))
        assert line[:, 0] == pytest.approx(seen, abs=1e-9)


@pytest.mark.parametrize(("longer", "is_refused"), [(1.24, False), (1.26, True)])
def test_a_view_may_stand_a_quarter_of_its_baseline_elsewhere(
    longer: float, is_refused: bool
) -> None:
    rig = SmallRig(name="sim", overrides=SMALL)
    true = true_geometry(rig.profile, rig.world.moment(0.0))
    poses = list(true.cam_from_reference)
    poses[1] = Pose(poses[1].rotation, longer * poses[1].translation_mm)
    moved = replace(true, cam_from_reference=tuple(poses))
    if is_refused:
        with pytest.raises(
            ConfigError, match=r"view left at \(-1\.\d+, -?0\.000\) view steps, the profile"
        ):
            calibrated_optics(rig.profile, moved, 3)
    else:
        assert calibrated_optics(rig.profile, moved, 3).calibration_id == 3


def nominal(size_px: tuple[int, int] | None) -> NominalOptics:
    return NominalOptics(np.zeros(1), np.zeros(1), 0, size_px=size_px)


def test_without_a_calibration_the_axis_is_the_middle_of_the_picture() -> None:
    assert nominal((160, 101)).axis_px == (79.5, 50.0)
    assert nominal(None).axis_px is None
    assert nominal(None).axis_variance_rad2.tolist() == [0.0, 0.0]
    assert nominal(None).reference_directions(np.array([2.0, 3.0])).tolist() == [2.0, 3.0]
    ray = nominal((160, 101)).ray((99.5, 40.0), 400.0)
    assert ray == pytest.approx([0.05, -0.025])
    assert nominal(None).ray((1.0, 1.0), 400.0) is None
    assert nominal((160, 101)).ray((1.0, 1.0), None) is None


def test_without_a_calibration_the_camera_of_depth_maps_looks_straight_on() -> None:
    assert nominal((160, 101)).pinhole((160, 101), None) is None
    pinhole = nominal(None).pinhole((160, 101), 400.0)
    assert pinhole is not None
    assert pinhole.matrix.tolist() == [[400.0, 0.0, 79.5], [0.0, 400.0, 50.0], [0.0, 0.0, 1.0]]
    assert (pinhole.width_px, pinhole.height_px) == (160, 101)
    assert pinhole.common_from_reference.tolist() == np.eye(3).tolist()
