"""Boards that move between the views of a picture: measured, and kept out of the lenses."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import (
    HEIGHT,
    WIDTH,
    BoardPose,
    TrueCamera,
    flat_board_mm,
    on_stage,
    random_scene,
    turn,
)

SCENE = random_scene(4, 24)
SHIFT_MM, TURN_DEG = 1.5, 0.3
POSITIONS_MM = np.linspace(0.0, 500.0, 8)


def solve(sightings: list[Sighting], **options: object) -> Calibration:
    names, sizes = ("centre", "right", "low"), [(WIDTH, HEIGHT)] * 3
    given = {"lens": "brown5", **options}
    return solve_rig(sightings, flat_board_mm(), sizes, names, 0, **given)  # pyright: ignore[reportArgumentType]


def moved(seed: int) -> list[Sighting]:
    """Every view shows the board elsewhere, about the same middle."""
    rng = np.random.default_rng(seed)
    found: list[Sighting] = []
    for view in range(3):
        poses = tuple(
            BoardPose(
                tuple(np.add(pose.middle_mm, rng.normal(0, SHIFT_MM, 3))),
                tuple(_turned(pose.turned_deg, rng.normal(0, TURN_DEG, 3))),
            )
            for pose in SCENE.poses
        )
        found += [s for s in replace(SCENE, poses=poses).sightings(seed) if s.view == view]
    return found


def _turned(degrees: tuple[float, float, float], by_deg: np.ndarray) -> np.ndarray:
    """Vector, in degrees, of one turn after another."""
    matrix = turn(by_deg) @ turn(degrees)
    axis = np.array(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )
    sine = np.sqrt(axis @ axis) / 2
    return np.degrees(np.arctan2(sine, (np.trace(matrix) - 1) / 2)) * axis / (2 * sine)


@cache
def of_moved() -> Calibration:
    return solve(moved(1))


def focal_errors_px(found: Calibration) -> np.ndarray:
    return np.array(
        [
            camera.fx_px - true.focal_px[0]
            for camera, true in zip(found.geometry.cameras, SCENE.cameras, strict=True)
            if isinstance(true, TrueCamera)
        ]
    )


@pytest.mark.slow
def test_the_motion_is_measured_and_told():
    found = of_moved()
    assert found.motion is not None
    assert found.motion.shift_mm == pytest.approx(SHIFT_MM, rel=0.25)
    assert np.degrees(found.motion.turn_rad) == pytest.approx(TURN_DEG, rel=0.25)
    assert found.rms_px == pytest.approx(0.02 * np.sqrt(2), rel=0.15)
    (note,) = [note for note in found.verdict.notes if "moved between the views" in note]
    assert f"{found.motion.shift_mm:.2g} mm" in note


@pytest.mark.slow
def test_motion_stays_out_of_the_lenses():
    bent = solve(moved(1), synchronous=True)
    assert bent.motion is None
    assert np.abs(focal_errors_px(of_moved())).max() < 0.2 * np.abs(focal_errors_px(bent)).max()


@pytest.mark.slow
def test_sigmas_hold_where_the_board_moved():
    off: list[float] = []
    for found in (of_moved(), solve(moved(2)), solve(moved(3))):
        assert found.geometry.covariance is not None
        sigma = np.sqrt(np.diag(found.geometry.covariance))
        off += (focal_errors_px(found) / sigma[[0, 9, 18]]).tolist()
        centres = found.geometry.centres_mm()[1:] - [c.centre_mm for c in SCENE.cameras[1:]]
        off += (centres / sigma[[[30, 31, 32], [36, 37, 38]]]).ravel().tolist()
    # 27 numbers, many of one cause: their scale is known to about a fifth.
    assert 0.6 < float(np.sqrt(np.mean(np.square(off)))) < 1.5


@pytest.mark.slow
def test_synchronous_views_lose_nothing():
    sightings = SCENE.sightings(2)
    found = solve(sightings)
    assert found.motion is None
    assert found.to_json() == solve(sightings, synchronous=True).to_json()


@pytest.mark.slow
def test_a_board_on_the_stage_is_at_rest():
    axis = np.array([0.005, 0.003, 1.0])
    scene = on_stage(SCENE, axis, POSITIONS_MM, 430.0)
    count = len(SCENE.poses)
    rest = [s for s in scene.sightings(3) if s.picture >= count]
    driver = {count + i: s for i, s in enumerate(POSITIONS_MM.tolist())}
    found = solve(moved(3) + rest, stage_mm=driver)
    assert found.motion is not None
    assert (found.motion.picture_scale[:count] > 0).all()
    assert (found.motion.picture_scale[count:] == 0).all()
    assert found.motion.shift_mm == pytest.approx(SHIFT_MM, rel=0.25)
    assert found.geometry.stage is not None
    sigma = np.sqrt(np.diag(found.geometry.stage.covariance))
    assert abs(found.geometry.stage.scale - np.sqrt(axis @ axis)) < 4 * sigma[2]
