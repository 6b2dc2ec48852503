"""The command line: help, profiles, plans, and what it says when it is used wrongly."""

import json

import pytest

from rig.database import open_store
from tests.support.command import Command


def test_help_names_every_verb(rig: Command):
    answer = rig("--help")
    assert answer.code == 0
    for verb in (
        "check",
        "sweep",
        "capture",
        "compare",
        "fit",
        "report",
        "history",
        "profile",
        "sim",
    ):
        assert verb in answer.out


def test_profiles_are_listed_with_their_description(rig: Command):
    answer = rig("profile", "list", "--json")
    names = {row["name"] for row in answer.json["profiles"]}
    assert {"sim", "sim-real"} <= names


def test_a_profile_is_shown_with_defaults_and_overrides(rig: Command):
    answer = rig("profile", "show", "sim", "--set", "sweep.count=5")
    assert "sweep.count = 5" in answer.out
    assert "sweep.settle_s = 0.4" in answer.out
    assert "views.left.x_steps = -1.06" in answer.out


def test_the_schema_is_json(rig: Command):
    assert json.loads(rig("profile", "schema").out)["title"] == "Profile"


def test_check_accepts_good_profiles_and_names_what_is_wrong(rig: Command):
    assert rig("profile", "check", "sim", "sim-real").code == 0
    answer = rig("profile", "check", "sim", "--set", "sweep.cuont=3")
    assert answer.code == 1
    assert "did you mean count?" in answer.err


def test_an_error_is_one_line_on_stderr_and_exit_code_1(rig: Command):
    answer = rig("sweep", "simm")
    assert answer.code == 1
    assert answer.out == ""
    assert answer.err == "rig: profile simm: not found in calib_profiles; did you mean sim?\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ("no-such-verb",),
        ("sweep",),
        ("sweep", "sim", "--samples", "0"),
        ("sweep", "sim", "500"),
        ("sweep", "sim", "--at-mm", "500,many"),
        ("sweep", "sim", "--at-mm", "500", "--count", "3"),
        ("sweep", "sim", "--resume", "1", "2"),
        ("capture", "sim", "--frames", "none"),
    ],
)
def test_wrong_use_is_exit_code_2(rig: Command, arguments: tuple[str, ...]):
    answer = rig(*arguments)
    assert answer.code == 2
    assert answer.err


def test_a_dry_run_prints_plan_and_time_and_stores_nothing(rig: Command):
    answer = rig("sweep", "sim", "--dry-run", "--from-mm", 400, "--to-mm", 800, "--count", 5)
    assert answer.code == 0
    assert "nothing was moved" in answer.out
    assert "800.000" in answer.out
    planned = rig("sweep", "sim", "--dry-run", "--at-mm", "450", "500,650", "--json").json
    assert [s["distance_mm"] for s in planned["stops"]][:3] == [450.0, 500.0, 650.0]
    assert planned["estimated_s"] > 0.0


@pytest.mark.parametrize("distance_mm", [399.0, 1201.0])
def test_distances_outside_the_travel_are_refused_before_anything_moves(
    rig: Command, distance_mm: float
):
    answer = rig("sweep", "sim", "--at-mm", distance_mm, 500)
    assert answer.code == 1
    assert "travel is 400.000..1200.000 mm" in answer.err


@pytest.mark.parametrize("verb", ["fit", "report"])
def test_an_unknown_sweep_is_named(rig: Command, verb: str):
    with open_store():
        pass
    answer = rig(verb, 7)
    assert answer.code == 1
    assert "7" in answer.err


def test_a_capture_without_a_curve_says_how_to_get_one(rig: Command):
    answer = rig("capture", "sim", "--frames", 1)
    assert answer.code == 1
    assert "rig sweep" in answer.err
