"""The depth-slope sweep over OAK cameras: their own pipeline and driver, simulated sensors."""

from importlib.util import find_spec
from pathlib import Path

import pytest

from rig.database import open_store
from tests.support.command import Command

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
