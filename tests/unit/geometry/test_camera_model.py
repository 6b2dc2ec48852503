"""Lens, camera and pose against closed forms, OpenCV and difference quotients."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel, distort, undistort
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

LENSES: list[tuple[LensModel, tuple[float, ...]]] = [
    ("none", ()),
    ("brown5", (-0.11, 0.06, 0.0011, -0.0007, -0.01)),
    ("brown8", (0.21, -0.05, 0.0006, 0.0004, 0.012, 0.31, -0.04, 0.02)),
    ("fisheye", (-0.02, 0.006, -0.003, 0.0008)),
]
GRID = np.stack(np.meshgrid(np.linspace(-0.7, 0.7, 9), np.linspace(-0.5, 0.5, 7)), -1).reshape(
    -1, 2
)


def camera(lens: LensModel, coefficients: tuple[float, ...]) -> CameraModel:
    return CameraModel(1280, 800, 881.3, 879.9, 637.2, 402.8, lens, coefficients)


@pytest.mark.parametrize(("lens", "coefficients"), LENSES)
def test_pixels_are_those_of_opencv(lens: LensModel, coefficients: tuple[float, ...]) -> None:
    points = np.column_stack([GRID * 700.0, np.full(len(GRID), 700.0)])
    model = camera(lens, coefficients)
    if lens == "fisheye":
        expected, _ = cv2.fisheye.projectPoints(
            points[:, None], np.zeros(3), np.zeros(3), model.matrix, np.array(coefficients)
        )
    else:
        expected, _ = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), model.matrix, np.array(coefficients or (0.0,) * 4)
        )
    assert model.project(points) == pytest.approx(np.asarray(expected).reshape(-1, 2), abs=1e-9)


@pytest.mark.parametrize(("lens", "coefficients"), LENSES)
def test_unproject_takes_project_back(lens: LensModel, coefficients: tuple[float, ...]) -> None:
    model = camera(lens, coefficients)
    points = np.column_stack([GRID, np.ones(len(GRID))])
    assert model.unproject(model.project(points)) == pytest.approx(GRID, abs=1e-11)


@pytest.mark.parametrize(("lens", "coefficients"), LENSES[1:])
def test_derivatives_are_difference_quotients(
    lens: LensModel, coefficients: tuple[float, ...]
) -> None:
    k = np.array(coefficients)
    step = 1e-6
    found = distort(lens, k, GRID)
    for axis in range(2):
        move = step * np.eye(2)[axis]
        change = (distort(lens, k, GRID + move).xy - distort(lens, k, GRID - move).xy) / (2 * step)
        assert found.by_xy[:, :, axis] == pytest.approx(change, abs=1e-8)
    for index in range(len(k)):
        move = step * np.eye(len(k))[index]
        change = (distort(lens, k + move, GRID).xy - distort(lens, k - move, GRID).xy) / (2 * step)
        assert found.by_coefficients[:, :, index] == pytest.approx(change, abs=1e-8)


def test_a_fold_has_no_inverse() -> None:
    lens = np.array([-0.5, 0.0, 0.0, 0.0, 0.0])
    folded = undistort("brown5", lens, np.array([[0.9, 0.0], [0.1, 0.0]]))
    assert np.isnan(folded[0]).all()
    assert np.isfinite(folded[1]).all()


def test_points_behind_have_no_pixel() -> None:
    pixels = camera("none", ()).project(np.array([[1.0, 1.0, -5.0], [1.0, 1.0, 0.0]]))
    assert np.isnan(pixels).all()


vectors = st.tuples(*[st.floats(-1.5, 1.5)] * 3).map(np.array)


@given(vectors, vectors, vectors, vectors)
def test_poses_chain_and_turn_back(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray
) -> None:
    one, two = Pose.from_vectors(a, 100.0 * b), Pose.from_vectors(c, 100.0 * d)
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 5.0, 600.0]])
    assert (one @ two).apply(points) == pytest.approx(one.apply(two.apply(points)), abs=1e-9)
    assert one.inverse().apply(one.apply(points)) == pytest.approx(points, abs=1e-9)
    assert one.apply(one.centre_mm[None]) == pytest.approx(np.zeros((1, 3)), abs=1e-9)


def test_what_is_no_camera_is_refused() -> None:
    with pytest.raises(ConfigError, match="coefficients"):
        CameraModel(640, 400, 600.0, 600.0, 320.0, 200.0, "brown5", (0.1,))
    with pytest.raises(ConfigError, match="focal lengths"):
        CameraModel(640, 400, -600.0, 600.0, 320.0, 200.0)
    with pytest.raises(ConfigError, match="no rigid motion"):
        Pose(np.diag([1.0, 1.0, -1.0]), np.zeros(3))


def test_a_geometry_has_one_camera_and_pose_per_view() -> None:
    one = camera("none", ())
    geometry = RigGeometry(
        ("a", "b"), 0, (one, one), (Pose.identity(), Pose(np.eye(3), np.array([-75.0, 0.0, 0.0])))
    )
    assert geometry.centres_mm()[1] == pytest.approx([75.0, 0.0, 0.0])
    assert geometry.parameter_count == 14
    with pytest.raises(ConfigError, match="one of each"):
        RigGeometry(("a", "b"), 0, (one,), (Pose.identity(),))
    with pytest.raises(ConfigError, match="covariance"):
        RigGeometry(("a",), 0, (one,), (Pose.identity(),), np.eye(3))


@pytest.mark.parametrize("angle_rad", [1e-9, 3e-6, 5e-5, 2e-4, 0.5, np.pi])
def test_a_pose_keeps_the_smallest_of_turns(angle_rad: float):
    vector = angle_rad * np.array([0.6, 0.0, 0.8])
    pose = Pose.from_vectors(vector, np.zeros(3))
    assert pose.rotation_rad == pytest.approx(vector, rel=1e-7)
