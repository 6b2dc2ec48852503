"""A true stage in another process, with a simulated camera: the board stands where it reports."""

import json
import re
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.command import Command
from tests.support.small_sim import SMALL_SIM, as_options
from tests.support.stores import sqlite_url

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
QUICK = (
    "world.firmware.boot_s=0.3",
    "world.firmware.max_rate_mm_s=800",
    "world.firmware.acceleration_mm_s2=8000",
    "world.firmware.homing_mm_s=800",
    "world.firmware.homing_locate_mm_s=100",
    "world.firmware.homing_pause_s=0.02",
)
TURNED = """[stage]
kind = "grbl"
port = "{port}"
travel_mm = [400.0, 1190.0]
distance_at_machine_zero_mm = 385.0
direction = -1
speed_mm_s = 800.0
acceleration_mm_s2 = 8000.0
"""
"""A stage that looks the other way than the simulated one of `sim`: only its own signs fit."""


@contextmanager
def stage_of_another_process() -> Generator[str]:
    """Give the pty of a stage that runs in a process of its own."""
    command = [sys.executable, "-m", "rig", "sim", "stage", "--json", *as_options(QUICK)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as serving:
        assert serving.stdout is not None
        try:
            told = b""
            while b"}" not in told:
                told += serving.stdout.readline()
            yield json.loads(told)["port"]
        finally:
            serving.terminate()


def profile_with(stage: str, folder: Path) -> Path:
    text = (Path(__file__).parents[2] / "calib_profiles/sim.toml").read_text()
    path = folder / "rehearsal.toml"
    path.write_text(re.sub(r"(?ms)^\[stage\]\n.*?(?=^\[)", lambda _: stage + "\n", text))
    return path


def test_the_simulated_board_follows_a_true_stage_with_its_own_signs(rig: Command, tmp_path: Path):
    with stage_of_another_process() as port:
        answer = rig(
            *("sweep", profile_with(TURNED.format(port=port), tmp_path), "--json"),
            *("--at-mm", "450,520,600,700,850,1000", "--samples", 1, "--db", sqlite_url(tmp_path)),
            *as_options((*SMALL_SIM, "sweep.backward_every=0", "sweep.settle_s=0.05")),
        )
    assert answer.code == 0, answer.err
    told = answer.json
    assert [p["distance_mm"] for p in told["points"]] == pytest.approx(
        [450, 520, 600, 700, 850, 1000], abs=0.02
    )
    # m = pitch * focal * (1 / Z - 1 / focus), with 40 mm, 305 px and 700 mm.
    for point in told["points"]:
        slope_px = 40.0 * 305.0 * (1.0 / point["distance_mm"] - 1.0 / 700.0)
        assert point["slope_px"] == pytest.approx(slope_px, abs=0.02)
    assert told["curve"]["focus_mm"] == pytest.approx(700.0, rel=1e-3)
