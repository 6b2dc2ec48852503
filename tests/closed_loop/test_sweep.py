"""Sweeps of the simulated rig from end to end, by the command line, with the analytic renderer."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from rig.database import open_store
from rig.depth import read_pfm
from rig.profile.load import load_profile
from tests.support.command import Command
from tests.support.small_sim import as_options

QUICK = ("--set", "world.renderer=analytic")
FIVE = ("--at-mm", "400,500,650,900,1200", "--samples", "1")
NO_HOLDOUT = ("--set", "sweep.holdout_every=0", "--set", "sweep.backward_every=0")


@pytest.mark.slow
def test_a_sweep_gives_a_curve_that_a_fit_repeats_to_the_last_digit(rig: Command):
    swept = rig("sweep", "sim", *as_options(), *FIVE, *NO_HOLDOUT, "--json")
    assert swept.code == 3  # without held-out distances nobody knows the depth error
    assert "held-out distances is unknown" in swept.err
    answer = swept.json
    assert len(answer["points"]) == 5
    world = load_profile("sim").world
    assert world is not None
    assert answer["curve"]["focus_mm"] == pytest.approx(world.optics.focus_mm, abs=1.0)
    assert Path(answer["report"]).is_file()

    fitted = rig("fit", answer["sweep"], "--json").json
    assert fitted["points"] == answer["points"]
    assert fitted["curve"]["params"] == answer["curve"]["params"]

    assert "concluded" in rig("history").out


OTHER_STAGES = {
    "zaber": ("kind=zaber", "port=sim://zaber", "direction=-1", "microstep_mm=0.0025"),
    "marlin": ("kind=marlin", "port=sim://marlin", "direction=-1"),
}


@pytest.mark.slow
@pytest.mark.parametrize("protocol", OTHER_STAGES)
def test_the_sweep_runs_unchanged_over_every_serial_protocol(rig: Command, protocol: str):
    stage = [word for part in OTHER_STAGES[protocol] for word in ("--set", f"stage.{part}")]
    plan = (*as_options(), *FIVE, *NO_HOLDOUT, "--json")
    over_grbl = rig("sweep", "sim", *plan).json
    swept = rig("sweep", "sim", *stage, *plan)
    assert swept.code == 3  # as over GRBL: without held-out distances no depth error is known
    answer = swept.json
    assert [p["distance_mm"] for p in answer["points"]] == pytest.approx(
        [p["distance_mm"] for p in over_grbl["points"]], abs=0.003
    )
    assert [p["slope_px"] for p in answer["points"]] == pytest.approx(
        [p["slope_px"] for p in over_grbl["points"]], abs=0.02
    )


@pytest.mark.slow
def test_held_out_distances_are_met(rig: Command):
    answer = rig("sweep", "sim", *QUICK, "--count", 9, "--samples", 2, "--json")
    assert answer.code == 0
    found = answer.json
    roles = [point["role"] for point in found["points"]]
    assert roles.count("holdout") == 2
    assert found["holdout"]["rms_pct"] < 0.05
    truth_px = 610.0 * 40.0 * (1.0 / 600.0 - 1.0 / 700.0)
    measured = {p["distance_mm"]: p["slope_px"] for p in found["points"]}
    nearest = min(measured, key=lambda distance_mm: abs(distance_mm - 600.0))
    assert measured[nearest] == pytest.approx(truth_px, abs=0.01)


@pytest.mark.slow
def test_a_rig_that_is_not_rectified_is_swept_and_says_so(rig: Command):
    plan = (*QUICK, "--count", "9", "--samples", "1")
    answer = rig("sweep", "sim-real", *plan, "--json")
    assert answer.code == 3
    assert "corners from their epipolar lines" in answer.err
    assert answer.json["holdout"]["rms_pct"] < 0.5
    assert answer.json["epipolar_px"]["mean"] > 1.0


@pytest.mark.slow
def test_rows_that_miss_are_said_and_stored_and_a_mended_rig_needs_a_new_curve(rig: Command):
    turned = ("--set", "world.view_errors.right.rotation_deg=[0.2, 0.0, 0.1]")
    lenient = ("--set", "quality.line_rms_px=3.0")
    plan = (*as_options(), *turned, *lenient, "--at-mm", "400,450,500,560,650,750,900,1050,1200")
    swept = rig("sweep", "sim", *plan, "--samples", "1", "--json")
    assert swept.code == 0
    (line,) = swept.json["rows"]
    assert line.startswith("rows: right is 1.3 px low at the ")
    assert swept.json["holdout"]["rms_pct"] < 0.01
    (row,) = rig("history", "--json").json["sweeps"]
    assert row["rows_rms_px"] == pytest.approx(1.1, abs=0.1)
    assert line in Path(swept.json["report"]).read_text()
    assert rig("fit", row["sweep"], "--json").json["rows"] == [line]

    desk = (*as_options(), "--set", "world.capture_scene=desk", "--set", "world.renderer=mitsuba")
    kept = rig(
        "capture", "sim", *desk, *turned, "--frames", 1, "--set", "quality.valid_share_pct=50"
    )
    assert kept.code == 0
    refused = rig("capture", "sim", *desk, "--frames", 1)
    assert refused.code == 1
    assert "rows miss otherwise than when curve 2 was made: right is" in refused.err


@pytest.mark.slow
def test_backlash_matters_and_the_approach_cancels_it(rig: Command):
    """A board 2 mm from where the stage says it is shows as forward against backward slopes."""
    plan = ("--at-mm", "400,500,600,700,800,1000,1200", "--samples", "1")
    loose = ("--set", "world.carriage.backlash_mm=2.0", "--set", "sweep.backward_every=2")

    def worst_difference_px(*approach: str) -> float:
        points = rig("sweep", "sim", *QUICK, *plan, *loose, *approach, "--json").json["points"]
        forward = {round(p["distance_mm"]): p for p in points if p["direction"] == "forward"}
        backward = [p for p in points if p["direction"] == "backward"]
        assert backward
        return max(
            abs(p["slope_px"] - forward[round(p["distance_mm"])]["slope_px"]) for p in backward
        )

    assert worst_difference_px("--set", "stage.approach_mm=4.0") < 0.01
    assert worst_difference_px("--set", "stage.approach_mm=0.0") > 0.05


@pytest.mark.slow
def test_a_board_outside_the_picture_is_named_and_loses_nothing(rig: Command):
    """Near stops do not show all of the board: they are named, the others make the curve."""
    answer = rig(
        "sweep", "sim", *QUICK, *NO_HOLDOUT, "--set", "world.board_offset_mm=[130.0, 0.0]",
        "--at-mm", "400,750,800,900,1000,1200", "--samples", "1", "--json",
    )  # fmt: skip
    assert answer.code == 3
    assert "400.0 mm (forward)" in answer.err
    assert "border" in answer.err or "edge" in answer.err
    assert len(answer.json["points"]) == 5
    with open_store(os.environ["RIG_DATABASE"]) as store:
        assert len(store.samples(answer.json["sweep"])) == 6


@pytest.mark.slow
def test_a_killed_sweep_is_resumed_where_it_stopped(rig: Command, tmp_path: Path):
    arguments = ["sweep", "sim", *QUICK, *FIVE, *NO_HOLDOUT]
    with start(arguments) as process:
        wait_for_samples(2)
        process.kill()
    with open_store(os.environ["RIG_DATABASE"]) as store:
        taken = store.samples(1)
    assert 2 <= len(taken) < 5
    answer = rig(*arguments[:2], "--resume", *QUICK, "--json")
    assert len(answer.json["points"]) == 5
    with open_store(os.environ["RIG_DATABASE"]) as store:
        assert [s.taken_at for s in store.samples(1)][: len(taken)] == [s.taken_at for s in taken]


@pytest.mark.slow
def test_ctrl_c_stops_the_stage_keeps_everything_and_can_be_resumed(rig: Command):
    real_time = ("--set", "world.clock=real")
    with start(["sweep", "sim", *QUICK, *FIVE, *NO_HOLDOUT, *real_time]) as process:
        wait_for_samples(2)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "the stage stands still" in errors
    with open_store(os.environ["RIG_DATABASE"]) as store:
        assert store.sweep(1).state == "taking"
        store.replace_measurements(1, {}, calibration_id=None)  # ended before any was measured
    resumed = rig("sweep", "sim", "--resume", 1, *QUICK, "--json")
    assert "measured again: slope differs by" in resumed.err
    assert len(resumed.json["points"]) == 5


@pytest.mark.slow
def test_a_rig_that_changed_meanwhile_is_refused(rig: Command):
    real_time = ("--set", "world.clock=real")
    with start(["sweep", "sim", *QUICK, *FIVE, *NO_HOLDOUT, *real_time]) as process:
        wait_for_samples(3)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 130
    moved = rig(
        "sweep", "sim", "--resume", *QUICK, "--set", "world.carriage.board_at_machine_zero_mm=1210"
    )
    assert moved.code == 1
    assert "have changed since the sweep began" in moved.err
    other = rig("sweep", "sim", "--resume", *QUICK, "--set", "pitch_mm=41.0")
    assert other.code == 1
    assert "pitch_mm differs" in other.err


@pytest.mark.slow
def test_slopes_of_a_capture_and_a_curve_of_another_rig(rig: Command, tmp_path: Path):
    swept = rig("sweep", "sim", *QUICK, *FIVE, *NO_HOLDOUT, "--json").json
    board = (*QUICK, "--set", "world.capture_scene=board", "--frames", "2")
    missed = rig("capture", "sim", *board)
    assert missed.code == 1
    assert "missed a quality gate" in missed.err
    chosen = ("--curve", swept["curve"]["id"])
    answer = rig("capture", "sim", *board, *chosen, "--out", tmp_path / "out", "--json")
    assert answer.json["frames"] == 2
    depth_mm = read_pfm(tmp_path / "out" / "depth_00001.pfm")
    assert depth_mm.shape == (400, 640)
    lines = (tmp_path / "out" / "frames.jsonl").read_text().splitlines()
    assert [json.loads(line)["frame"] for line in lines] == [0, 1]
    assert np.isfinite(read_pfm(tmp_path / "out" / "sigma_00001.pfm")).any()
    for override in ("name=other", "views.left.x_steps=-1.0", "pitch_mm=50.0"):
        refused = rig("capture", "sim", *board, "--set", override, *chosen)
        assert refused.code == 1
        assert "belongs to another rig" in refused.err


def start(arguments: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", "from rig.cli import main; main()", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_samples(count: int) -> None:
    """Wait until a sweep in another process has stored so many samples."""
    database = os.environ["RIG_DATABASE"].removeprefix("sqlite:///")
    deadline_s = time.monotonic() + 120.0
    while time.monotonic() < deadline_s:
        if Path(database).is_file():
            with open_store() as store:
                if store.sweeps() and store.sweeps()[-1].samples >= count:
                    return
        time.sleep(0.2)
    pytest.fail(f"{count} samples were not stored within 120 s")
