"""`rig setup` at a terminal: left after the first step, taken up again, and led to a curve."""

import sys
from pathlib import Path

import pytest

from tests.support.command import Command
from tests.support.small_sim import SMALL_PAIR, as_options
from tests.support.terminal import CTRL_C, CTRL_D, typed

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


def test_a_wrong_answer_is_told_and_asked_again(tmp_path: Path):
    said, code = typed(
        [*SETUP, "sim", "--db", f"sqlite:///{tmp_path}/rig.sqlite"],
        PROMPTS,
        ["yes", "S", "skip", "n", "q"],
        tmp_path,
    )
    assert code == 0, said
    assert "'yes' is no answer: press Enter alone to run it, s to skip it, q to leave" in said
    assert "'n' is no answer" in said
    assert not (tmp_path / "sim-target.pdf").exists()
    assert "skip  check" in said
    assert "next: rig setup sim goes on with rig calibrate sim" in said


@pytest.mark.parametrize(
    ("profile", "answers", "command"),
    [
        ("sim", [CTRL_C], "rig target sim"),
        ("sim", ["", CTRL_C], "rig target sim"),
        ("sim", ["s", CTRL_C], "rig check sim"),
        ("sim", ["s", "s", CTRL_C], "rig calibrate sim"),
        ("sim", ["s", "s", "s", CTRL_C], "rig sweep sim"),
        ("nobody-yet", [CTRL_C], "rig devices"),
        ("nobody-yet", ["s", CTRL_C], "rig profile new nobody-yet"),
    ],
)
def test_ctrl_c_at_a_question_leaves_and_says_how_to_go_on(
    profile: str, answers: list[str], command: str, tmp_path: Path
):
    options = [profile, "--db", f"sqlite:///{tmp_path}/rig.sqlite"]
    said, code = typed([*SETUP, *options], PROMPTS, answers, tmp_path)
    assert code == 130, said
    assert f"\r\nnext: rig setup {profile} goes on with {command}" in said
    assert "Traceback" not in said


def test_a_closed_terminal_leaves(tmp_path: Path):
    options = ["sim", "--db", f"sqlite:///{tmp_path}/rig.sqlite"]
    said, code = typed([*SETUP, *options], PROMPTS, [CTRL_D], tmp_path)
    assert code == 0, said
    assert "next: rig setup sim goes on with rig target sim" in said


def test_who_skips_everything_is_not_sent_to_capture(tmp_path: Path):
    options = ["sim", "--db", f"sqlite:///{tmp_path}/rig.sqlite"]
    said, code = typed([*SETUP, *options], PROMPTS, ["s", "s", "s", "s"], tmp_path)
    assert code == 0, said
    assert said.rstrip().splitlines()[-1].startswith("next: rig setup sim goes on with rig target")


def test_ctrl_c_in_a_sweep_leaves_and_the_same_command_resumes_it(tmp_path: Path):
    database = f"sqlite:///{tmp_path}/rig.sqlite"
    (tmp_path / "sim-target.pdf").touch()
    quick = (*SMALL_PAIR, "sweep.count=12", "sweep.samples=2", "sweep.backward_every=0")
    options = ["sim", "--db", database, *as_options(quick)]
    prompts = (PROMPTS[0], "[1/24]")
    said, code = typed([*SETUP, *options], prompts, ["s", "s", "", CTRL_C], tmp_path)
    assert code == 130, said
    said, code = typed([*SETUP, *options], PROMPTS, ["s", "s", ""], tmp_path)
    assert "rig sweep sim --resume 1" in said
    assert code == 0, said
    assert "done  sweep      curve 1" in said
