"""The choice of a common frame: normal, facing, upright, principal points."""

from dataclasses import replace

import numpy as np
import pytest

from rig.geometry import rectification
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rectification import rectify
from rig.geometry.rig_geometry import RigGeometry
from tests.support.calibration_scene import turn

FLAT_MM = np.array([[0.0, 0.0, 0.0], [-40.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]])


@pytest.mark.parametrize("turned_deg", [(0.0, 0.0, 0.0), (3.0, -2.0, 0.0), (-10.0, 20.0, 0.0)])
def test_the_normal_is_square_to_the_plane_of_the_cameras(
    turned_deg: tuple[float, float, float],
) -> None:
    rotation = turn(turned_deg)
    normal = rectification._normal(FLAT_MM @ rotation.T + np.array([5.0, 6.0, 7.0]))
    assert normal == pytest.approx(rotation[:, 2], abs=1e-12)
    facing = rectification._facing(normal)
    assert facing @ normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    # The shortest of such rotations turns by the angle between the two.
    angle = np.arccos((np.trace(facing) - 1) / 2)
    assert angle == pytest.approx(np.arccos(normal[2]), abs=1e-7)


@pytest.mark.parametrize("off_deg", [0.0, 2.0, -3.0])
def test_rows_and_columns_are_turned_upright(off_deg: float) -> None:
    turned = FLAT_MM @ turn((0.0, 0.0, off_deg)).T
    found = rectification._upright(np.eye(3), turned)
    assert found == pytest.approx(turn((0.0, 0.0, -off_deg)), abs=1e-12)


def test_views_that_are_turned_differently_count_by_their_squared_distance() -> None:
    near = np.array([0.0, 10.0, 0.0]) @ turn((0.0, 0.0, 1.0)).T
    far = np.array([-30.0, 0.0, 0.0]) @ turn((0.0, 0.0, 3.0)).T
    found = rectification._upright(np.eye(3), np.stack([np.zeros(3), near, far]))
    assert found == pytest.approx(turn((0.0, 0.0, -2.8)), abs=1e-9)


def test_views_far_from_both_axes_have_no_say() -> None:
    diagonal = np.array([[0.0, 0.0, 0.0], [40.0, 40.0, 0.0], [-40.0, 40.0, 0.0]])
    assert rectification._upright(np.eye(3), diagonal).tolist() == np.eye(3).tolist()
    some = np.concatenate([diagonal, FLAT_MM @ turn((0.0, 0.0, 2.0)).T])
    found = rectification._upright(np.eye(3), some)
    assert found == pytest.approx(turn((0.0, 0.0, -2.0)), abs=1e-12)


def rig(middles_px: list[tuple[float, float]]) -> RigGeometry:
    """Four parallel cameras in one plane."""
    cameras = tuple(CameraModel(160, 101, 480.0, 520.0, *middle) for middle in middles_px)
    poses = tuple(Pose(np.eye(3), -place) for place in FLAT_MM)
    return RigGeometry(("a", "b", "c", "d"), 0, cameras, poses)


def test_principal_points_follow_the_places_of_the_views() -> None:
    """Middles that move by 0.25 px per mm are kept as they are, but for unlike focal lengths."""
    middles = [(79.5 + 0.25 * x, 50.0 + 0.25 * y) for x, y, _ in FLAT_MM.tolist()]
    geometry = rig(middles)
    square = tuple(replace(c, fx_px=500.0, fy_px=500.0) for c in geometry.cameras)
    found = rectify(replace(geometry, cameras=square), 40.0)
    assert found.common_from_reference == pytest.approx(np.eye(3), abs=1e-15)
    assert (found.camera.cx_px, found.camera.cy_px) == pytest.approx((79.5, 50.0))
    assert found.infinity_px == pytest.approx(10.0)
    assert found.x_steps == pytest.approx([0.0, -1.0, 1.0, 0.0])
    assert found.y_steps == pytest.approx([0.0, 0.0, 0.0, 1.0])
    assert found.focus_mm == pytest.approx(500.0 * 40.0 / 10.0)
    for view, middle in enumerate(middles):
        seen = found.view_camera(view)
        assert (seen.cx_px, seen.cy_px) == pytest.approx(middle)


def test_the_common_frame_has_focal_length_and_size_of_the_reference() -> None:
    geometry = rig([(79.5, 50.0)] * 4)
    cameras = list(geometry.cameras)
    cameras[3] = replace(cameras[3], width_px=200, fx_px=600.0, fy_px=720.0)
    found = rectify(replace(geometry, cameras=tuple(cameras)), 20.0)
    assert found.camera.fx_px == found.camera.fy_px == pytest.approx(500.0)
    assert found.shape == (101, 160)
    assert found.x_steps == pytest.approx([0.0, -2.0, 2.0, 0.0])
    assert found.pitch_mm == 20.0


def test_a_view_before_the_plane_has_its_offset_in_steps_per_pixel() -> None:
    places = np.concatenate([FLAT_MM, [[0.0, -40.0, 0.0], [0.0, 0.0, 0.0]]])
    offsets = np.array([0.0, 1.0, 1.0, -1.0, -1.0, 0.0])
    poses = tuple(
        Pose(np.eye(3), -(p + np.array([0.0, 0.0, z])))
        for p, z in zip(places, offsets, strict=True)
    )
    camera = CameraModel(160, 101, 500.0, 500.0, 79.5, 50.0)
    found = rectify(RigGeometry(tuple("abcdef"), 0, (camera,) * 6, poses), 40.0)
    assert found.z_steps == pytest.approx(offsets / 40.0 / 500.0, abs=1e-12)


def test_a_column_of_cameras_has_a_baseline() -> None:
    geometry = rig([(79.5, 50.0)] * 4)
    column = RigGeometry(
        ("a", "b"),
        0,
        geometry.cameras[:2],
        (Pose.identity(), Pose(np.eye(3), np.array([0, -40.0, 0]))),
    )
    assert rectify(column, 40.0).y_steps == pytest.approx([0.0, 1.0])
