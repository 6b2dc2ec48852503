"""The depth-slope sweep over OAK cameras: their own pipeline and driver, simulated sensors."""

import os
from importlib.util import find_spec
from pathlib import Path

import cv2
import pytest
from rig_sim.world import World

from rig.database import open_store, software_versions
from rig.devices import SystemClock
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.command import Command
from tests.support.geometry import true_geometry

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        find_spec("depthai") is None, reason="depthai is not installed: pip install -e '.[oak]'"
    ),
]

QUICK = (
    *("--set", "world.renderer=analytic"),
    *("--set", "camera.timeout_s=60"),  # four sensors of a busy machine share its processors
    *("--set", "world.firmware.boot_s=0.1"),
    *("--set", "world.firmware.homing_mm_s=800"),
    *("--set", "world.firmware.homing_pause_s=0.02"),
    *("--set", "world.firmware.max_rate_mm_s=800"),
    *("--set", "world.firmware.acceleration_mm_s2=4000"),
    *("--set", "stage.speed_mm_s=700"),
    *("--set", "stage.acceleration_mm_s2=4000"),
    *("--set", "sweep.backward_every=0"),
)
PLAN = ("--at-mm", "400,450,500,550,650,800,1000,1200", "--samples", "1")


def test_a_sweep_runs_unchanged_and_live_depth_follows_from_it(rig: Command, tmp_path: Path):
    swept = rig("sweep", "sim-oak", *QUICK, *PLAN, "--json")
    assert swept.code == 0, swept.err
    answer = swept.json
    assert answer["holdout"]["rms_pct"] < 0.1
    assert answer["curve"]["focus_mm"] == pytest.approx(700.0, abs=0.5)
    with open_store(f"sqlite:///{tmp_path}/bench/rig.sqlite") as store:
        camera = store.sweep(answer["sweep"]).devices["camera"]
    assert isinstance(camera, dict)
    assert camera["kind"] == "oak"
    assert camera["model"] == "host nodes, no device"

    out = tmp_path / "depth"
    board = ("--set", "world.renderer=analytic", "--set", "world.capture_scene=board")
    captured = rig("capture", "sim-oak", *board, "--frames", "3", "--out", out, "--json")
    assert captured.json["frames"] == 3
    assert captured.json["skew_ms"]["max"] < 5.0
    assert len((out / "frames.jsonl").read_text().splitlines()) == 3


SMALLER = (
    *("--set", "camera.width_px=320"),
    *("--set", "camera.height_px=200"),
    *("--set", "world.optics.focal_px=225.0"),
    *("--set", "camera.sensors.colour.width_px=480"),
    *("--set", "camera.sensors.colour.height_px=270"),
    *("--set", "world.view_errors.colour.focal_px=380.0"),
)


def test_three_unlike_cameras_reach_a_curve_through_their_calibration(rig: Command, tmp_path: Path):
    profile = load_profile("sim-oak-d", [one for one in SMALLER if one != "--set"])
    world = World(profile, clock=SystemClock(), carriage=Slide(), scene="board")
    moment = world.moment(0.0)
    with open_store(os.environ["RIG_DATABASE"]) as store:
        calibration_id = store.save_calibration(
            rig="sim-oak-d",
            geometry=geometry_to_json(true_geometry(profile, moment)),
            quality={},
            profile=profile.model_dump(mode="json"),
            versions=software_versions(),
            devices={},
            temperature_degc=24.0,
            image_size_px=(480, 270),
        )
    plan = ("--at-mm", "400,440,480,540,620,720,850", "--samples", "1")
    swept = rig("sweep", "sim-oak-d", *QUICK, *SMALLER, *plan, "--json")
    assert swept.code == 0, swept.err
    answer = swept.json
    assert answer["calibration"]["id"] == calibration_id
    assert answer["holdout"]["rms_pct"] < 0.1
    assert answer["curve"]["valid_mm"] == pytest.approx([400.0, 850.0], abs=5.0)
    out = tmp_path / "depth"
    board = ("--set", "world.renderer=analytic", "--set", "world.capture_scene=board")
    board = (*board, "--set", "quality.valid_share_pct=0", *SMALLER)
    captured = rig("capture", "sim-oak-d", *board, "--frames", "1", "--out", out, "--json")
    assert captured.code in (0, 3), captured.err
    colour = cv2.imread(str(out / "colour_00000.png"))
    assert colour is not None
    assert colour.shape == (270, 480, 3)
    red, blue = colour[..., 2].mean(), colour[..., 0].mean()
    assert red > 1.3 * blue

    again = ("--set", "world.view_errors.right.rotation_deg=[0.2, -0.1, -0.25]")
    refused = rig("capture", "sim-oak-d", *board, *again, "--frames", "1")
    assert refused.code == 1
    assert "was made while the device held the calibration" in refused.err
    assert "then `rig sweep sim-oak-d`" in refused.err
