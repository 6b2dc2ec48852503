"""Cameras, frames and depth as robots see them, against projective geometry in closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.arrays import Float
from rig.errors import ConfigError
from rig.live.measure import pinhole_of
from rig.optics.nominal import nominal_optics
from rig.profile import ViewConfig
from rig.recording import CameraInfo, FrameTransform
from rig.robots.depth import DepthForRobots, whole_mm
from rig.robots.scene import robot_name, scene_of
from rig.stored import Run
from rig.testing.simulated import open_simulated_rig
from tests.unit.robots.robot_rig import LENSES, geometry, optics, profile, run

POINTS_MM = np.array([[0.0, 0.0, 600.0], [90.0, -50.0, 700.0], [-120.0, 60.0, 900.0]])
"""In the reference camera's frame."""


def projected(camera: CameraInfo, points_m: Float) -> Float:
    """Pixels (N, 2) of points in the frame of the rectified reference view."""
    homogeneous = np.column_stack([points_m, np.ones(len(points_m))])
    u = homogeneous @ camera.projection.T
    return u[:, :2] / u[:, 2:]


def optical_from_base(transform: FrameTransform, points_m: Float) -> Float:
    rotation = Rotation.from_quat(transform.quaternion).as_matrix()
    return (points_m - transform.translation_m) @ rotation


def test_projection_matrices_hit_the_pixels_of_the_rectified_views():
    rectification = optics().rectification
    scene = scene_of(run(), (100, 160), rectification.pinhole)
    common_m = POINTS_MM @ rectification.common_from_reference.T / 1000.0
    for view, name in enumerate(geometry().names):
        raw_px = geometry().project(view, POINTS_MM)
        expected_px = rectification.rectified_px(view, raw_px)
        found_px = projected(scene.cameras[name], common_m)
        # A projection matrix has no room for how far a view stands before the others.
        bound_px = 1e-6 if view == 0 else 0.7
        assert np.abs(found_px - expected_px).max() < bound_px, name


def test_transforms_with_matrices_hit_the_pixels_exactly():
    rectification = optics().rectification
    scene = scene_of(run(), (100, 160), rectification.pinhole)
    common_m = POINTS_MM @ rectification.common_from_reference.T / 1000.0
    base_m = common_m[:, [2, 0, 1]] * (1, -1, -1)  # x forward, y left, z up
    by_child = {transform.child: transform for transform in scene.transforms}
    for view, name in enumerate(geometry().names):
        transform = by_child[f"{name}_optical_frame"]
        assert transform.parent == "rig_link"
        local_m = optical_from_base(transform, base_m)
        matrix = scene.cameras[name].projection[:, :3]
        pixels = local_m @ matrix.T
        expected = rectification.rectified_px(view, geometry().project(view, POINTS_MM))
        assert pixels[:, :2] / pixels[:, 2:] == pytest.approx(expected, abs=1e-6)


def test_raw_cameras_are_those_of_the_calibration():
    scene = scene_of(run(), (100, 160), optics().rectification.pinhole)
    for view, (name, lens) in enumerate(zip(geometry().names, LENSES, strict=True)):
        camera, info = geometry().cameras[view], scene.cameras[name]
        assert (info.lens, info.coefficients) == (lens, camera.coefficients)
        assert (info.width_px, info.height_px) == (160, 100)
        assert (info.matrix == camera.matrix).all()
        rays = info.rectification @ np.array([0.1, -0.2, 1.0])
        back = optics().rectification.camera_from_common(view) @ rays
        assert back == pytest.approx([0.1, -0.2, 1.0])
    assert scene.depth_camera is not None
    assert (scene.depth_camera.projection[:, 3] == 0.0).all()
    assert (scene.depth_camera.matrix == optics().rectification.pinhole.matrix).all()
    assert scene.reference == "centre"


@pytest.mark.slow
def test_depth_counts_along_the_rectified_view_and_points_lie_where_they_are():
    pinhole = optics().rectification.pinhole
    shape = (pinhole.height_px, pinhole.width_px)
    # A plane in the reference camera's frame: z = 500 + 0.2 x - 0.1 y.
    depth_mm = np.full(shape, np.nan, np.float32)
    rows, columns = np.indices(shape, dtype=np.float64)
    x_px, y_px = pinhole.principal_point_px
    rays = np.stack([(columns - x_px) / pinhole.focal_px, (rows - y_px) / pinhole.focal_px], -1)
    rays = np.concatenate([rays, np.ones((*shape, 1))], -1) @ pinhole.common_from_reference
    rays /= rays[..., 2:]
    depth_mm[:] = 500.0 / (1.0 - 0.2 * rays[..., 0] + 0.1 * rays[..., 1])
    depth_mm[0, :7] = np.nan
    sigma_mm = depth_mm / np.float32(100.0)
    label = np.where(np.isnan(depth_mm), 0, 1).astype(np.uint8)
    found = DepthForRobots(pinhole, points=True).of(depth_mm, sigma_mm, label)
    expected_m = (pinhole.points_mm(depth_mm) @ pinhole.common_from_reference.T) / 1000.0
    assert found.depth_m == pytest.approx(expected_m[..., 2], rel=1e-6, nan_ok=True)
    assert not np.allclose(found.depth_m[50], depth_mm[50] / 1000.0, rtol=1e-3)
    assert found.sigma_m == pytest.approx(found.depth_m / 100.0, rel=1e-6, nan_ok=True)
    assert found.label is label
    assert found.points is not None
    known = np.isfinite(depth_mm)
    assert len(found.points) == known.sum() == 160 * 100 - 7
    assert found.points[:, :3] == pytest.approx(expected_m[known], rel=1e-5, abs=1e-7)
    assert (found.points[:, 3] == found.sigma_m[known]).all()
    assert DepthForRobots(pinhole, points=False).of(depth_mm, sigma_mm, label).points is None


def test_without_a_calibration_depth_is_the_same_in_m():
    depth_mm = np.array([[np.nan, 1234.0]], np.float32)
    found = DepthForRobots(None, points=True).of(depth_mm, depth_mm, np.array([[0, 1]], np.uint8))
    assert found.depth_m == pytest.approx(np.array([[np.nan, 1.234]]), nan_ok=True)
    assert found.points is None


def test_whole_mm_marks_what_16_bits_cannot_hold():
    depth_m = np.array([[np.nan, 0.0004, 0.0006, 1.2344, 65.535, 65.536]], np.float32)
    assert whole_mm(depth_m).tolist() == [[0, 0, 1, 1234, 65535, 0]]


def nominal_run() -> Run:
    with open_simulated_rig() as camera:
        brought = camera.run.curve
    assert brought is not None
    return Run(profile(), nominal_optics(profile()), brought)


def test_a_curve_alone_tells_the_cameras_of_views_that_converge():
    nominal = nominal_run()
    assert nominal.curve is not None
    law = nominal.curve.curve
    scene = scene_of(nominal, (100, 160), pinhole_of(nominal, (100, 160)))
    assert scene.depth_camera is not None
    focal_px = law.params["a_px_mm"] / 40.0
    z0_mm = law.params["z0_mm"]
    for distance_mm in (480.0, 700.0, 990.0):
        slope_px = float(law.slope_px(np.array([distance_mm]))[0])
        # The law counts distances from z0; a projection matrix from the optical centre.
        point_m = np.array([[20.0, -10.0, distance_mm - z0_mm]]) / 1000.0
        reference_px = projected(scene.cameras["centre"], point_m)
        for view in profile().views:
            found_px = projected(scene.cameras[view.name], point_m)
            shift_px = slope_px * np.array([view.x_steps, view.y_steps])
            assert found_px == pytest.approx(reference_px - shift_px, abs=0.02), view.name
    left = next(t for t in scene.transforms if t.child == "left_optical_frame")
    assert left.translation_m == pytest.approx((0.0, 1.06 * 0.04, 0.0))
    assert scene.cameras["left"].projection[0, 3] == pytest.approx(focal_px * 1.06 * 0.04)
    assert scene.cameras["bottom"].projection[1, 3] == pytest.approx(-focal_px * 1.08 * 0.04)


def test_maps_that_are_smaller_than_the_pictures_have_a_camera_of_their_own():
    nominal = nominal_run()
    scene = scene_of(nominal, (100, 160), pinhole_of(nominal, (50, 80)))
    assert scene.depth_camera is not None
    assert (scene.depth_camera.width_px, scene.depth_camera.height_px) == (80, 50)
    assert scene.depth_camera.matrix[:2, 2].tolist() == [39.5, 24.5]
    assert (scene.cameras["centre"].width_px, scene.cameras["centre"].height_px) == (160, 100)
    assert scene.cameras["centre"].matrix[:2, 2].tolist() == [79.5, 49.5]


def test_without_a_focal_length_there_are_frames_and_no_cameras():
    scene = scene_of(Run(profile(), nominal_optics(profile())), (100, 160), None)
    assert scene.cameras == {}
    assert scene.depth_camera is None
    assert len(scene.transforms) == 5


def test_names_of_views_become_names_of_topics():
    assert [robot_name(view) for view in ("left", "cam-1", "3", "_x")] == [
        "left",
        "cam_1",
        "view_3",
        "view__x",
    ]
    views = [ViewConfig(name=name, x_steps=i, y_steps=0.0) for i, name in enumerate(("a-b", "a_b"))]
    twice = profile().model_copy(update={"views": views})
    with pytest.raises(ConfigError, match="a-b, a_b have the same name in topics"):
        scene_of(Run(twice, nominal_optics(twice)), (100, 160), None)


def test_whole_mm_takes_parts_of_a_map_as_they_lie_in_memory():
    depth_m = np.linspace(0.0, 70.0, 12, dtype=np.float32).reshape(3, 4)
    assert whole_mm(depth_m[:, ::2]).tolist() == whole_mm(depth_m)[:, ::2].tolist()
