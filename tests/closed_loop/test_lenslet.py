"""A simulated lenslet camera, from its white picture to a curve and to depth."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from rig.cli.verbs import app
from rig.live.captured import read_capture

pytestmark = pytest.mark.slow


def run(*words: str):
    """Run a verb; return its JSON."""
    result = CliRunner().invoke(app, [*words, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_a_lenslet_camera_is_calibrated_swept_and_gives_depth(tmp_path: Path):
    database = ("--db", f"sqlite:///{tmp_path}/rig.db")
    found = run("calibrate", "sim-lenslet", *database)
    assert found["spacing_px"] == pytest.approx(10.03, abs=0.001)
    assert found["rotation_deg"] == pytest.approx(0.17, abs=0.002)
    assert found["corner_sigma_px"] < 0.005

    swept = run("sweep", "sim-lenslet", *database, "--count", "7", "--samples", "1")
    assert swept["holdout"]["rms_pct"] < 0.5
    assert swept["curve"]["focus_mm"] == pytest.approx(600.0, abs=1.0)
    assert swept["curve"]["valid_mm"] == [350.0, 1000.0]

    taken = run(
        "capture", "sim-lenslet", *database, "--frames", "1", "--out", str(tmp_path / "out")
    )
    assert taken["frames"] == 1
    assert taken["valid_pct"] > 20.0
    (frame,) = read_capture(tmp_path / "out")
    virtual = frame.virtual_depth
    assert virtual is not None
    # Of a hexagonal lattice of 10.03 px, 1.5 px per view step.
    per_slope = np.nanmedian(virtual / frame.slope_px)
    assert per_slope == pytest.approx(math.sqrt(0.75) * 10.03 / 1.5, rel=1e-3)
