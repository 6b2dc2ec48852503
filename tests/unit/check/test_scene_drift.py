"""What is said of a scene and a calibration, and what is kept of it."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from rig.check.scene_drift import drift_details, judge_scene_drift
from rig.epipolar.scene.drift import SceneDrift
from rig.profile.load import load_profile
from rig.records import StoredCalibration

PAIR = load_profile("checkerboard-stereo")
NAME = PAIR.views[1 - PAIR.reference].name
CALIBRATION = StoredCalibration(
    3, PAIR.name, datetime(2026, 11, 2, tzinfo=UTC), {}, {}, {}, {}, {}, 31.5, (640, 480),
    active=True,
)  # fmt: skip


def drift(**changed: object) -> SceneDrift:
    turned, sigma = np.zeros((2, 3)), np.zeros((2, 3))
    turned[1 - PAIR.reference] = 0.012, 0.003, -0.016
    sigma[1 - PAIR.reference] = 0.005, 0.02, 0.0025
    whole = SceneDrift(turned, sigma, 0.12, 1e-7, None, 3, (-0.1, 0.9), 480)
    return replace(whole, **changed)  # pyright: ignore[reportArgumentType]


def test_a_turn_is_told_with_its_sigma_and_what_it_means():
    item = judge_scene_drift(drift(), PAIR, CALIBRATION, 33.0)
    assert item.status == "warn"
    # 0.02 deg along (0.6, -0.8): its sigma is hypot(0.6 x 0.005, 0.8 x 0.0025).
    assert f"{NAME} has turned 0.020 +- 0.004 deg (pitch +0.012, roll -0.016)" in item.found
    assert "since calibration 3 of 2026-11-02 (probability 1e-07)" in item.found
    assert "depth at 1 m is off by -0.1..+0.9 %" in item.found
    assert "+1.5 degC since then" in item.found
    assert f"rig calibrate {PAIR.name}" in item.advice
    assert item.numbers["temperature_degc"] == 33.0


def test_rows_that_moved_far_fail():
    assert judge_scene_drift(drift(rows_px=0.31), PAIR, CALIBRATION, None).status == "fail"
    assert judge_scene_drift(drift(rows_px=0.3), PAIR, CALIBRATION, None).status == "warn"


@pytest.mark.parametrize(("probability", "status"), [(1e-4, "pass"), (0.9e-4, "warn")])
def test_chance_is_no_drift(probability: float, status: str):
    item = judge_scene_drift(drift(probability=probability), PAIR, CALIBRATION, None)
    assert item.status == status


def test_what_a_scene_cannot_tell_is_named():
    item = judge_scene_drift(drift(depth_pct=(-3.0, 1.1)), PAIR, CALIBRATION, None)
    assert "what that means for depth a scene cannot tell; show the board" in item.found


def test_a_rig_as_it_was_passes_and_says_how_sure():
    item = judge_scene_drift(drift(probability=0.4), PAIR, CALIBRATION, None)
    assert "nothing has turned since calibration 3 of 2026-11-02 that rows tell" in item.found
    assert f"{NAME} pitch +-0.005, roll +-0.003 deg" in item.found
    assert item.advice == ""
    assert "degC" not in item.found


def test_what_is_kept_is_plain():
    assert drift_details(drift(), PAIR) == {
        "turned_deg": {NAME: [0.012, 0.003, -0.016]},
        "sigma_deg": {NAME: [0.005, 0.02, 0.0025]},
        "rows_px": 0.12,
        "probability": 1e-7,
        "depth_pct": [-0.1, 0.9],
        "features": 480,
    }


def test_a_reference_that_turned_is_named():
    found = judge_scene_drift(drift(alone=PAIR.reference), PAIR, CALIBRATION, None).found
    assert found.startswith(f"{PAIR.views[PAIR.reference].name} has turned against all other views")
