"""`sim-real`, with misaligned, distorting cameras and a slanted stage, through its calibration."""

import os
from pathlib import Path

import numpy as np
import pytest

from rig.database import open_store, software_versions
from rig.depth import read_pfm
from rig.geometry.rectification import rectify
from rig.geometry.rig_geometry_json import geometry_to_json
from tests.support.cameras import SmallRig
from tests.support.command import Command
from tests.support.geometry import true_geometry

QUICK = ("--set", "world.renderer=analytic")
PLAN = ("--at-mm", "400,500,600,700,850,1000,1200", "--samples", "1")
REAL = SmallRig(name="sim-real")


def store_the_truth() -> int:
    """Put the true cameras and stage into the database as a calibration."""
    geometry = true_geometry(REAL.profile, REAL.world.moment(0.0))
    with open_store(os.environ["RIG_DATABASE"]) as store:
        return store.save_calibration(
            rig="sim-real",
            geometry=geometry_to_json(geometry),
            quality={},
            profile=REAL.profile.model_dump(mode="json"),
            versions=software_versions(),
            devices={},
            temperature_degc=24.0,
            image_size_px=(640, 400),
        )


@pytest.mark.slow
def test_a_calibrated_rig_reaches_the_depth_of_a_perfect_one(rig: Command, tmp_path: Path) -> None:
    before = rig("sweep", "sim-real", *QUICK, *PLAN, "--json")
    assert before.json["calibration"] is None
    calibration_id = store_the_truth()

    # The same frames, measured again: no hardware, another calibration.
    after = rig("fit", before.json["sweep"], "--calibration", str(calibration_id), "--json")
    assert after.json["calibration"]["id"] == calibration_id
    assert after.json["holdout"]["rms_pct"] < 0.01
    assert after.json["calibration"]["cameras_against_stage_pct"] < 0.01
    assert after.json["epipolar_px"]["max"] < 0.2
    assert before.json["epipolar_px"]["mean"] > 1.0
    # Slanted stage and wrong scale: the distances themselves are others.
    far_mm = max(point["distance_mm"] for point in after.json["points"])
    assert far_mm == pytest.approx(1199.99, abs=0.02)
    alignment = after.json["alignment"]
    assert alignment["calibrated"]
    # The reference camera is turned by (0.1, -0.15) deg against world and board.
    assert alignment["board"]["right_deg"] == pytest.approx(-0.15, abs=0.02)
    assert alignment["board"]["down_deg"] == pytest.approx(-0.10, abs=0.02)
    assert alignment["stage"]["right_deg"] == pytest.approx(0.55, abs=0.02)
    assert alignment["stage"]["down_deg"] == pytest.approx(-0.20, abs=0.02)

    refused = rig("capture", "sim-real", *QUICK, "--calibration", "none", "--frames", "1")
    assert refused.code == 1
    assert f"measured with calibration {calibration_id}" in refused.err

    out = tmp_path / "depth"
    board = ("--set", "world.capture_scene=board")
    captured = rig("capture", "sim-real", *QUICK, *board, "--frames", "1", "--out", str(out))
    assert captured.code in (0, 3)
    geometry = true_geometry(REAL.profile, REAL.world.moment(0.0))
    shape = rectify(geometry, REAL.profile.pitch_mm).shape
    assert read_pfm(out / "depth_00000.pfm").shape == shape
    assert (out / "camera.json").is_file()
    assert np.isfinite(read_pfm(out / "depth_00000.pfm")).any()
