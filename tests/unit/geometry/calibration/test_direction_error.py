"""Directions of one camera alone: closed forms, a known camera, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.direction_error import (
    direction_error,
    direction_error_of,
    direction_sigma_px,
)
from rig.geometry.bundle.part import COLUMNS, ROWS, nodes_px
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.support.calibration_scene import (
    HEIGHT,
    WIDTH,
    BoardPose,
    TrueCamera,
    flat_board_mm,
    random_scene,
)

SIZE = (641, 401)
NODES = nodes_px(SIZE).reshape(-1, 2)
EVERYWHERE = np.ones(len(NODES), np.bool_)


def one_camera(variances: Float, focal_px: float = 500.0) -> RigGeometry:
    camera = CameraModel(*SIZE, focal_px, focal_px, 320.0, 200.0)
    return RigGeometry(("webcam",), 0, (camera,), (Pose.identity(),), np.diag(variances))


def test_a_focal_length_moves_directions_by_their_distance_from_the_middle():
    sigma_px = direction_sigma_px(one_camera(np.array([4.0, 0, 0, 0])), NODES, EVERYWHERE)
    # 2 px of 500 along x only; half of the variance falls on each coordinate.
    assert sigma_px == pytest.approx(np.abs(NODES[:, 0] - 320.0) / 500.0 * 2.0 / np.sqrt(2.0))


def test_a_principal_point_is_a_turn_but_for_the_bend_of_the_field():
    sigma_px = direction_sigma_px(
        one_camera(np.array([0, 0, 9.0, 0]), focal_px=1e6), NODES, EVERYWHERE
    )
    assert sigma_px == pytest.approx(np.zeros(len(NODES)), abs=1e-5)
    near = direction_sigma_px(one_camera(np.array([0, 0, 9.0, 0])), NODES, EVERYWHERE)
    x, y = (NODES - (320.0, 200.0)).T / 500.0
    turned = np.stack([1 + x * x, x * y], axis=1)  # px per px of a turn about y
    best = float(np.sum(turned[:, 0]) / np.sum(turned**2))
    left = np.array([1.0, 0.0]) - best * turned
    assert near == pytest.approx(3.0 * np.sqrt(np.sum(left**2, axis=1) / 2.0))


def test_the_headline_is_twice_the_rms_where_boards_were_seen():
    seen = np.zeros((ROWS, COLUMNS), np.bool_)
    seen[:, COLUMNS // 2 + 2] = True
    geometry = one_camera(np.array([4.0, 0, 0, 0]))
    found = direction_error(geometry, seen)
    # The turn is fitted to one column: about y by its shift along x, which it takes away there.
    x, y = (NODES.reshape(ROWS, COLUMNS, 2)[:, COLUMNS // 2 + 2] - (320.0, 200.0)).T / 500.0
    turned = np.stack([1 + x * x, x * y], axis=1)
    best = float(np.sum(turned[:, 0] * x) / np.sum(turned**2))
    rest = np.stack([x, 0 * x], axis=1) - best * turned
    wanted = 2.0 * 2.0 * np.sqrt(np.mean(np.sum(rest**2, axis=1) / 2.0))
    assert found.seen_px == pytest.approx(wanted, rel=1e-6)
    assert found.seen_px < found.picture_px < found.worst_px
    nothing = direction_error(geometry, np.zeros((ROWS, COLUMNS), np.bool_))
    assert np.isnan([nothing.seen_px, nothing.picture_px, nothing.worst_px]).all()


def test_two_views_or_no_covariance_are_told():
    geometry = one_camera(np.zeros(4))
    with pytest.raises(CalibrationError, match="1 views without covariance"):
        direction_error(replace(geometry, covariance=None), EVERYWHERE.reshape(ROWS, COLUMNS))
    two = RigGeometry(
        ("a", "b"), 0, geometry.cameras * 2, (Pose.identity(),) * 2, np.zeros((14, 14))
    )
    with pytest.raises(CalibrationError, match="2 views with covariance"):
        direction_error(two, EVERYWHERE.reshape(ROWS, COLUMNS))


def solved(count: int, seed: int, noise_px: float = 0.02) -> tuple[Calibration, Float]:
    scene = random_scene(seed, count)
    # Of a camera alone the board may reach over every border; it goes round the picture's thirds.
    poses = tuple(
        BoardPose((p.middle_mm[0] - 25, p.middle_mm[1] - 25, p.middle_mm[2]), p.turned_deg)
        for p in scene.poses
    )
    one = replace(scene, cameras=scene.cameras[:1], poses=poses, corner_px=noise_px)
    found = solve_rig(
        one.sightings(seed), flat_board_mm(), [(WIDTH, HEIGHT)], ("webcam",), 0, lens="brown5"
    )
    camera = scene.cameras[0]
    assert isinstance(camera, TrueCamera)
    return found, camera.numbers


@pytest.mark.slow
def test_one_camera_alone_is_found_within_its_own_uncertainty():
    found, true = solved(18, 4)
    (camera,) = found.geometry.cameras
    assert found.geometry.covariance is not None
    sigma = np.sqrt(np.diag(found.geometry.covariance))
    off = np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px]) - true[:4]
    assert (np.abs(off) < 3.5 * sigma[:4]).all()
    assert found.depth_error == ()
    assert found.verdict.good, str(found.verdict)
    assert not found.verdict.notes  # of one camera nothing rests on the size of the squares
    error = direction_error_of(found)
    assert 0.03 < error.seen_px < 0.15
    assert error.seen_px <= error.picture_px < error.worst_px


@pytest.mark.slow
def test_too_few_noisy_pictures_of_one_camera_are_weak_by_their_directions():
    found, _ = solved(9, 4, noise_px=0.6)
    (text,) = [r.text for r in found.verdict.reasons if r.code == "direction-error"]
    assert "0.5 px wanted" in text
    assert f"{direction_error_of(found).seen_px:.2f} px" in text
