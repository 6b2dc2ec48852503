"""Depth from frames that came through the kernel: the guest took them, the host measures."""

import json
from pathlib import Path

import pytest

from rig.database import open_store, software_versions
from rig.recording import recorded
from tests.hardware.vivid.sweep_bench import VARIANTS, stops
from tests.support.command import Command

pytestmark = pytest.mark.slow


def test_the_sweep_over_v4l2_cameras_makes_a_curve_that_keeps_its_gates(
    rig: Command, guest_results: Path, tmp_path: Path
):
    told = json.loads((guest_results / "sweep.json").read_text())
    url = f"sqlite:///{tmp_path}/sweep/rig.sqlite"
    with open_store(url) as store:
        sweep_id = store.create_sweep(
            rig=told["profile"]["name"],
            profile=told["profile"],
            stops=stops(),
            samples_per_stop=VARIANTS,
            versions=software_versions(),
            devices={},
        )
        taken = list(recorded(guest_results / "sweep.mcap"))
        for (stop, number, reached_mm), found in zip(told["samples"], taken, strict=True):
            store.add_sample(
                sweep_id, stop=stop, number=number, reached_mm=reached_mm, multiview=found.views
            )
    answer = rig("fit", str(sweep_id), "--db", url, "--json")
    assert answer.code == 0, answer.err
    assert len(answer.json["points"]) == len(stops())
    assert answer.json["curve"]["focus_mm"] == pytest.approx(700.0, abs=1.0)
    assert answer.json["holdout"]["max_pct"] <= 0.1
