"""`rig calibrate` as its user runs it: simulated, with the stage, and on real pictures."""

from pathlib import Path

import numpy as np
import pytest

from rig.geometry.bundle import Calibration
from tests.support.command import Command
from tests.support.shared_data import SHARED
from tests.support.stores import sqlite_url

SMALL_AND_QUICK = (
    *("--set", "world.renderer=analytic"),
    *("--set", "world.hand.hold_s=0.7", "--set", "world.hand.move_s=0.05"),
)
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def real(name: str) -> Path:
    folder = SHARED / name
    if not folder.is_dir():
        pytest.skip(f"no pictures in {folder}; set RIG_SHARED_DATA")
    return folder


def test_a_rig_with_faults_is_calibrated_with_its_stage_and_goes_on_after_an_end(
    rig: Command, tmp_path: Path
):
    database = ("--db", sqlite_url(tmp_path))
    few = rig("calibrate", "sim-real", "--pictures", 3, *SMALL_AND_QUICK, *database)
    folder = next((tmp_path / "frames" / "sim-real").glob("calibration_*"))
    (folder / "calibration.json").unlink()  # as if it had been killed before the end
    assert few.code in (1, 3)
    answer = rig(
        *("calibrate", "sim-real", "--stage", "--resume", "--pictures", 12, "--json"),
        *("--lens", "brown5", *SMALL_AND_QUICK, *database),
    )
    assert answer.code in (0, 3), answer.err
    assert "3 pictures are there already" in answer.err
    told = answer.json
    assert told["pictures"] == 12 + 9
    assert told["reprojection_px"]["held_out_rms"] < 0.05
    assert told["epipolar_px"]["mean"] < 0.05
    at_1_m = next(e for e in told["depth_error"] if e["distance_mm"] == 1000.0)
    assert 0 < at_1_m["picture_pct"] < 0.5
    calibration = Calibration.from_json(Path(told["file"]).read_text())
    stage = calibration.geometry.stage
    assert stage is not None
    # The world's truth: a scale of 1.0015, and an axis 0.4 and -0.3 deg off the nominal camera,
    # whose reference is itself turned by 0.1, -0.15, 0.05 deg.
    assert stage.scale == pytest.approx(1.0015, abs=5e-4)
    right_deg, down_deg = np.degrees(np.arctan2(stage.axis[:2], stage.axis[2]))
    assert right_deg == pytest.approx(0.4 + 0.15, abs=0.05)
    assert down_deg == pytest.approx(-0.3 + 0.1, abs=0.05)
    assert "stage position 0" in told["depth_zero"]
    assert Path(told["report"]).stat().st_size > 10_000


def test_real_stereo_pairs_are_calibrated_with_one_command(rig: Command, tmp_path: Path):
    folder = real("checkerboard-stereo")
    answer = rig(
        *("calibrate", "checkerboard-stereo", "--set", f"camera.folder={folder}", "--json"),
        *("--lens", "brown5", "--db", sqlite_url(tmp_path)),
    )
    assert answer.code == 3, answer.err  # some of its pairs were taken with the board in motion
    told = answer.json
    assert told["found"] == {"left": 25, "right": 25}
    assert told["reprojection_px"]["held_out_rms"] < 0.2
    assert told["epipolar_px"]["mean"] < 0.12
    assert any("board moved" in r["text"] for r in told["verdict"]["reasons"])


def test_four_real_cameras_are_calibrated_from_their_videos(rig: Command, tmp_path: Path):
    folder = real("charuco-4cam")
    answer = rig(
        *("calibrate", "charuco-4cam", "--frames", folder, "--json", "--lens", "brown5"),
        *("--db", sqlite_url(tmp_path)),
    )
    assert answer.code == 3, answer.err
    told = answer.json
    assert all(count >= 38 for count in told["found"].values())
    assert any("not synchronised" in r["text"] for r in told["verdict"]["reasons"])
    geometry = Calibration.from_json(Path(told["file"]).read_text()).geometry
    apart_mm = np.linalg.norm(geometry.centres_mm(), axis=1)
    # Another tool's calibration of the same videos puts them there (camera_array.toml).
    assert apart_mm == pytest.approx([0.0, 1131.0, 549.0, 427.0], rel=0.06)
