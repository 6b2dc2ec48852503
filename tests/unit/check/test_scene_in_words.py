"""`rig check --scene` and what `rig history` tells of it."""

from pathlib import Path

import pytest

from rig.database import open_store
from tests.support.command import Command
from tests.support.stores import new_calibration


@pytest.fixture
def looked(rig: Command, tmp_path: Path) -> Command:
    """A database with two looks at scenes."""
    with open_store(f"sqlite:///{tmp_path}/bench/rig.sqlite") as store:
        calibration = new_calibration(store)
        for rows_px, degc in ((0.0123, 31.25), (0.25, None)):
            details = {"rows_px": rows_px, "probability": 2e-9, "turned_deg": {"right": [0.02]}}
            store.save_drift(calibration, rig="bench", details=details, temperature_degc=degc)
    return rig


def test_looks_are_listed_with_temperature_and_chance(looked: Command):
    lines = [line.split() for line in looked("history").out.splitlines()]
    first, second = (line for line in lines if line[-1:] == ["2e-09"])
    assert first[-4:] == ["1", "31.2", "0.012", "2e-09"]
    assert second[-3:] == ["1", "0.250", "2e-09"]


def test_programs_get_all_of_a_look(looked: Command):
    first, second = looked("history", "--json").json["drifts"]
    assert (first["drift"], first["calibration"], first["rig"]) == (1, 1, "bench")
    assert first["temperature_degc"] == 31.25
    assert first["turned_deg"] == {"right": [0.02]}
    assert second["temperature_degc"] is None


@pytest.mark.parametrize("words", [("--rig", "other"), ("--tag", "x"), ("--failed",)])
def test_looks_that_are_not_asked_for_are_left_out(looked: Command, words: tuple[str, ...]):
    assert looked("history", "--json", *words).json["drifts"] == []


def test_a_rig_without_a_calibration_is_told(rig: Command):
    answer = rig("check", "checkerboard-stereo", "--scene", "--json")
    assert answer.code == 0
    (item,) = answer.json["items"]
    assert (item["item"], item["status"]) == ("scene", "skip")
    assert "no stored geometric calibration" in item["found"]
    assert item["advice"] == "rig calibrate checkerboard-stereo"
