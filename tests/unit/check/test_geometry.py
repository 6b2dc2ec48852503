"""Judgement of a geometric calibration by one picture, from the stored row to the item."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock
from rig_sim.world import World

from rig.check.geometry_drift import judge_geometry_drift, judge_misfit
from rig.frames import Frame, MultiView
from rig.geometry.camera_model import CameraModel
from rig.geometry.drift import Drift
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.profile import SimCameraConfig
from rig.profile.load import load_profile
from rig.records import StoredCalibration
from tests.support.small_sim import SMALL_SIM

PROFILE = load_profile("sim", SMALL_SIM)
FINE = Drift(1.1, 30, 0.3, {0: (0.01, 0.0), 1: (-0.01, 0.0)}, rms_px=0.001, px_per_mm=0.75)


class Still:
    """A carriage that stays."""

    def travelled_mm(self, t_s: float) -> float:
        return -403.0


def picture(*changes: str) -> MultiView:
    """The simulated rig's view of its board at 800 mm."""
    profile = load_profile("sim", (*SMALL_SIM, *changes))
    world = World(profile, clock=VirtualClock(), carriage=Still(), scene="board")
    assert isinstance(profile.camera, SimCameraConfig)
    with SimCamera(profile.camera, world) as camera:
        return camera.grab(1.0)


def stored(covariance: float | None = 1.0) -> StoredCalibration:
    """The true cameras of the simulated rig, known to 0.05 px, 10 urad and 5 um."""
    cameras, poses = [], []
    for view in PROFILE.views:
        x_mm, y_mm = 40.0 * view.x_steps, 40.0 * view.y_steps
        shift = 305.0 / 700.0  # the sensor is shifted so that 700 mm has no disparity
        centre = (159.5 + shift * x_mm, 99.5 + shift * y_mm)
        cameras.append(CameraModel(320, 200, 305.0, 305.0, *centre))
        poses.append(Pose(np.eye(3), -np.array([x_mm, y_mm, 0.0])))
    sigma = np.array([0.05] * 20 + ([1e-5] * 3 + [0.005] * 3) * 4)
    names = tuple(view.name for view in PROFILE.views)
    geometry = RigGeometry(
        names, 0, tuple(cameras), tuple(poses),
        None if covariance is None else covariance * np.diag(sigma**2),
    )  # fmt: skip
    return StoredCalibration(
        id=3, rig="sim", created_at=datetime(2026, 5, 4, tzinfo=UTC),
        geometry=geometry_to_json(geometry), quality={}, profile={}, versions={}, devices={},
        temperature_degc=20.0, image_size_px=(320, 200), active=True,
    )  # fmt: skip


def test_a_rig_that_is_as_it_was_passes():
    item = judge_geometry_drift(PROFILE, stored(), picture())
    assert item.status == "pass"
    assert "calibration 3 of 2026-05-04" in item.found
    assert "+5.0 degC since then" in item.found


def test_a_camera_that_was_turned_fails():
    item = judge_geometry_drift(
        PROFILE, stored(), picture("world.view_errors.left.rotation_deg=[0.3, 0.2, 0.0]")
    )
    assert item.status == "fail"
    assert "rig calibrate sim" in item.advice
    shifts = item.numbers["displaced_px"]
    assert isinstance(shifts, dict)
    assert max(shifts, key=lambda view: np.hypot(*shifts[view])) == "left"


def test_a_board_that_is_not_there_is_told():
    blank = tuple(
        Frame(view.name, np.zeros((200, 320), np.uint8), 0.0, 0) for view in PROFILE.views
    )
    item = judge_geometry_drift(PROFILE, stored(), MultiView(blank))
    assert item.status == "fail"
    assert "dark picture" in item.found


def test_without_covariance_target_or_calibration_the_item_says_why_it_is_skipped():
    without = PROFILE.model_copy(update={"target": None})
    items = [
        judge_geometry_drift(PROFILE, stored(None), picture()),
        judge_geometry_drift(without, stored(), picture()),
        judge_geometry_drift(PROFILE, None, picture()),
    ]
    assert [item.status for item in items] == ["skip"] * 3
    assert "no covariance" in items[0].found
    assert "no [target]" in items[1].found
    assert "no stored geometric calibration" in items[2].found
    assert items[0].advice == items[2].advice == "rig calibrate sim"


def test_a_calibration_that_cannot_be_read_fails_and_the_check_goes_on():
    damaged = replace(stored(), geometry={"version": 99})
    item = judge_geometry_drift(PROFILE, damaged, picture())
    assert item.status == "fail"
    assert "99" in item.found
    assert "calibrate again" in item.advice


@pytest.mark.parametrize(
    ("probability", "rms_px", "status"),
    [(0.3, 0.1, "pass"), (1e-9, 0.001, "pass"), (1e-9, 0.01, "warn"), (1e-9, 0.02, "fail")],
)
def test_what_is_certain_counts_by_the_depth_that_it_is_worth(
    probability: float, rms_px: float, status: str
):
    """0.05 % of a disparity of 40 mm x 0.75 px/mm = 30 px are 0.015 px."""
    drift = replace(FINE, probability=probability, rms_px=rms_px)
    item = judge_misfit(drift, PROFILE, calibration="calibration 1", warmer_degc=None)
    assert item.status == status
    assert item.numbers["worth_pct"] == pytest.approx(rms_px / 0.3)
