"""`rig setup` at a terminal: left after the first step, taken up again, and led to a curve."""

import sys
from pathlib import Path

import pytest

from tests.support.command import Command
from tests.support.small_sim import SMALL_PAIR, as_options
from tests.support.terminal import typed

SETUP = (sys.executable, "-m", "rig", "setup")
PROMPTS = ("[Enter] run, s skip, q leave: ", "[Enter] when that is done: ")
QUICK = (*SMALL_PAIR, "sweep.count=6", "sweep.samples=1", "sweep.backward_every=0")
pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]


def test_it_leads_to_a_curve_and_goes_on_where_it_was_left(rig: Command, tmp_path: Path):
    database = f"sqlite:///{tmp_path}/rig.sqlite"
    options = ["sim", "--db", database, *as_options(QUICK)]
    said, code = typed(
        [*SETUP, *options], PROMPTS, ["", "", "q"], tmp_path
    )  # draw the board, it is printed, enough
    assert code == 0, said
    assert (tmp_path / "sim-target.pdf").stat().st_size > 1000
    assert "Print sim-target.pdf at 100 %" in said
    assert "next: rig setup sim goes on with rig check sim" in said
    said, code = typed(
        [*SETUP, *options], PROMPTS, ["", "s", ""], tmp_path
    )  # check; calibrated by hand; sweep
    assert code == 0, said
    assert "done  target     sim-target.pdf" in said
    assert ", 0 fail, " in said
    assert "skip  calibrate" in said
    assert "done  sweep      curve 1" in said
    assert said.rstrip().endswith("next: rig capture sim")
    told = rig("setup", *options, "--json").json
    assert told["next"] == "rig capture sim"
    assert all(step["done"] for step in told["steps"])
