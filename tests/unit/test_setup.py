"""Which step of a first run comes next, by what files and database show; what follows a verb."""

import re
import string
from pathlib import Path

import pytest

from rig.cli.next_verb import NEXT, tell_next
from rig.cli.setup_steps import Step, Wish, steps_of
from rig.cli.verbs import VERBS
from rig.database import open_store
from rig.profile.load import load_profile
from rig.profile.template import Recipe, profile_text
from tests.support.command import Command

WITHOUT_NEXT = {"sim", "completion", "setup", "fit"}
"""A server, words for a shell, the verb that leads through all others, and what ends as a sweep."""


def by_name(steps: tuple[Step, ...]) -> dict[str, str | None]:
    return {step.name: step.found for step in steps}


def test_without_a_profile_devices_are_looked_at_and_one_is_written(tmp_path: Path):
    first, second = steps_of(Wish("not-there-yet"), tmp_path)
    assert (first.command, first.found) == ("rig devices", None)
    assert (second.command, second.found) == ("rig profile new not-there-yet", None)


def test_a_profile_with_guesses_is_to_be_settled(tmp_path: Path):
    path = tmp_path / "bench.toml"
    path.write_text(profile_text(Recipe("bench", "v4l2", 2, "grbl")))
    wish = Wish(str(path), ("sweep.count=5",), f"sqlite:///{tmp_path}/no.sqlite")
    steps = steps_of(wish, tmp_path)
    assert by_name(steps) == dict.fromkeys(("profile", "target", "check", "calibrate", "sweep"))
    assert steps[0].command == f"rig profile check {path} --set sweep.count=5"
    assert steps[2].command == (
        f"rig check {path} --set sweep.count=5 --db sqlite:///{tmp_path}/no.sqlite"
    )
    assert "clear the way of the carriage" in steps[2].why
    assert not (tmp_path / "no.sqlite").exists()


def test_a_rig_without_stage_or_target_has_fewer_steps(tmp_path: Path):
    path = tmp_path / "bench.toml"
    text = profile_text(Recipe("bench", "v4l2", 2, None)).replace("MEASURE", "measured")
    path.write_text(text)
    assert list(by_name(steps_of(Wish(str(path)), tmp_path))) == [
        "profile", "target", "check", "calibrate",
    ]  # fmt: skip
    path.write_text(re.sub(r"(?ms)^\[target\]\n.*?(?=^\[slopes|^# Slopes)", "", text))
    assert list(by_name(steps_of(Wish(str(path)), tmp_path))) == ["profile", "check"]


def test_what_is_there_shows_what_is_done_and_what_lies_before_it(tmp_path: Path):
    database = f"sqlite:///{tmp_path}/rig.sqlite"
    wish = Wish("sim", database=database)
    (tmp_path / "sim-target.pdf").touch()
    found = by_name(steps_of(wish, tmp_path))
    assert found["profile"] is not None
    assert found["target"] == str(tmp_path / "sim-target.pdf")
    assert found["check"] is found["calibrate"] is found["sweep"] is None
    with open_store(database) as store:
        number = store.save_calibration(
            rig="sim",
            geometry={},
            quality={},
            profile=load_profile("sim").model_dump(mode="json"),
            versions={},
            devices={},
            temperature_degc=None,
            image_size_px=(640, 400),
        )
    found = by_name(steps_of(wish, tmp_path))
    assert found["calibrate"] == found["check"] == f"calibration {number}"
    assert found["sweep"] is None


def test_a_sweep_that_was_begun_goes_on(tmp_path: Path):
    database = f"sqlite:///{tmp_path}/rig.sqlite"
    profile = load_profile("sim")
    with open_store(database) as store:
        number = store.create_sweep(
            rig="sim",
            profile=profile.model_dump(mode="json"),
            stops=(),
            samples_per_stop=1,
            versions={},
            devices={},
        )
    sweep = steps_of(Wish("sim", database=database), tmp_path)[-1]
    assert sweep.found is None
    assert sweep.command == f"rig sweep sim --resume {number} --db {database}"


def test_a_command_can_be_typed_and_holds_no_password():
    words = ("sweep", "sim", "--set", "views={a=1}", "--db", "postgresql://me:secret@host/rig")
    told = Step("sweep", "why", words).command
    assert told == "rig sweep sim --set 'views={a=1}' --db postgresql://...@host/rig"


def test_without_a_terminal_it_says_what_comes_next(rig: Command, tmp_path: Path):
    database = f"sqlite:///{tmp_path}/rig.sqlite"
    answer = rig("setup", "sim", "--db", database, "--set", "sweep.count=5", "--json")
    assert answer.code == 0
    assert answer.json["next"] == "rig target sim --out sim-target.pdf --set sweep.count=5"
    assert [step["done"] for step in answer.json["steps"]] == [True, False, False, False, False]
    assert answer.err == ""


def test_every_verb_names_the_next_one():
    verbs = {name for group in VERBS.values() for name in group} - WITHOUT_NEXT
    assert {re.split("[ ,]", key)[0] for key in NEXT} == verbs
    asked = {f[1] for text in NEXT.values() for f in string.Formatter().parse(text)}
    assert asked == {None, "profile", "sweep"}


def test_the_next_verb_is_one_line_on_stderr_and_not_for_programs(
    capsys: pytest.CaptureFixture[str],
):
    tell_next("sweep, gate", as_json=False, sweep=7, profile="bench")
    tell_next("sweep, gate", as_json=True, sweep=7, profile="bench")
    came = capsys.readouterr()
    assert came.out == ""
    assert came.err == "next: rig report 7 shows where; then rig check bench\n"
