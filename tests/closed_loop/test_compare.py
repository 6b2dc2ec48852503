"""A sweep of the simulated rig, then all methods on its frames, by the command line."""

import json
from pathlib import Path

import pytest

from rig.cli.compare import compare
from tests.support.command import Command

QUICK = ("--set", "world.renderer=analytic")
FIVE = ("--at-mm", "400,500,650,900,1200", "--samples", "1")
NO_HOLDOUT = ("--set", "sweep.holdout_every=0", "--set", "sweep.backward_every=0")


@pytest.mark.slow
def test_our_distances_are_nearer_to_the_stage_than_those_of_a_pair(rig: Command, tmp_path: Path):
    swept = rig("sweep", "sim", *QUICK, *FIVE, *NO_HOLDOUT, "--json").json
    compare(
        "sim",
        curve_id=swept["curve"]["id"],  # nothing was held out, so no curve is taken by itself
        out=tmp_path / "out",
        overrides=["world.renderer=analytic", "world.capture_scene=board"],
    )
    numbers = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert (numbers["curve"], numbers["sweep"]) == (swept["curve"]["id"], swept["sweep"])
    assert numbers["frames"]["partner"] == "bottom"
    assert [round(board["distance_mm"]) for board in numbers["distances"]] == [
        400, 500, 650, 900, 1200,
    ]  # fmt: skip
    score = {one["method"]: one for one in numbers["summary"]}
    assert score["rig, plane known"]["bias_pct"] < 0.1
    for matcher in ("SAD", "StereoBM", "SGBM-3WAY", "SGBM-HH"):
        assert score["rig"]["bias_mm"] < score[matcher]["bias_mm"]
        assert score["rig"]["spread_mm"] < score[matcher]["spread_mm"]
    html = (tmp_path / "out" / "compare.html").read_text()
    assert 'aria-label="Error of all methods against distance"' in html
