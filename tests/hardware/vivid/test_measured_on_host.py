"""Depth from frames that came through the kernel: the guest took them, the host measures."""

from pathlib import Path

import pytest

from tests.support.command import Command

pytestmark = pytest.mark.slow


def test_the_sweep_over_v4l2_cameras_makes_a_curve_that_keeps_its_gates(
    rig: Command, guest_results: Path
):
    answer = rig("fit", "1", "--db", f"sqlite:///{guest_results}/sweep/rig.sqlite", "--json")
    assert answer.code == 0, answer.err
    found = answer.json
    assert len(found["points"]) == 8
    assert found["curve"]["focus_mm"] == pytest.approx(700.0, abs=1.0)
    assert found["holdout"]["max_pct"] <= 0.1
