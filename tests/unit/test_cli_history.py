"""`rig history`: what is stored of every sweep, and what to do next."""

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rig.cli.history import Wanted
from rig.cli.history_result import next_step
from rig.database import Store, open_store
from rig.records import HistoryRow, Provenance, State
from tests.support.command import Command
from tests.support.kept_stores import kept_store
from tests.support.multiviews import noisy_multiview
from tests.support.stores import STOPS, new_sweep

ROW = HistoryRow(
    id=7,
    rig="desk",
    started_at=datetime(2026, 7, 1, tzinfo=UTC),
    ended_at=None,
    state="taking",
    stops_done=2,
    stops_planned=3,
    samples=5,
    curve_id=None,
    holdout_rms_pct=None,
)


@pytest.mark.parametrize(
    ("state", "stops_done", "says"),
    [
        ("taking", 2, "rig sweep desk --resume 7"),
        ("taken", 3, "rig sweep desk --resume 7 (concludes it, without devices)"),
        ("concluded", 3, "rig report 7"),
        ("failed", 2, "put the cause right, then rig sweep desk --resume 7"),
        ("failed", 3, "rig fit 7 says why it has no curve; put that right, and sweep again"),
    ],
)
def test_every_state_says_what_to_do_next(state: State, stops_done: int, says: str):
    assert next_step(replace(ROW, state=state, stops_done=stops_done)) == says


def test_a_sweep_with_somebody_at_work_is_to_be_left_alone():
    assert next_step(replace(ROW, at_work="process 3 on desk")) == "let it end: process 3 on desk"


def test_states_and_owners_are_listed(rig: Command, tmp_path: Path):
    with open_store(f"sqlite:///{tmp_path}/bench/rig.sqlite") as store:
        running, taken = new_sweep(store), new_sweep(store, samples_per_stop=1)
        for stop in STOPS:
            store.add_sample(
                taken, stop=stop.index, number=0, reached_mm=1.0, multiview=noisy_multiview(0)
            )
        with store.owned_sweep(running, "asked"):
            rows = rig("history", "--json").json["sweeps"]
            owner = store.owner(f"sweep {running}")
            lines = rig("history").out.splitlines()
    assert [row["state"] for row in rows] == ["taking", "taken"]
    assert [row["at_work"] for row in rows] == [str(owner), None]
    assert rows[0]["next"] == f"let it end: {owner}"
    assert lines[1].endswith("what to do next")
    assert lines[2].endswith(rows[0]["next"])
    assert lines[3].endswith("rig sweep bench --resume 2 (concludes it, without devices)")


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Store]:
    """Sweep 1 concluded, 2 taken, 3 failed of another rig, unit and tag; calibration 1."""
    with kept_store(tmp_path / "bench") as store:
        number = store.create_sweep(
            rig="desk", profile={}, stops=STOPS, samples_per_stop=1, versions={}, devices={},
            unit="B2", note="after the fall",
            provenance=Provenance("ada", "bench-2", "rig sweep desk", ("night", "cold")),
        )  # fmt: skip
        store.stop_sweep(number, failed=True)
        yield store


def test_runs_are_chosen(bench: Store):
    found = bench.history(bench.frames)
    began_at = found.sweeps[2].started_at
    for wanted, sweeps, calibrations in (
        (Wanted(), [1, 2, 3], 1),
        (Wanted(rig="desk"), [3], 0),
        (Wanted(rig="bench"), [1, 2], 1),
        (Wanted(unit="B2"), [3], 0),
        (Wanted(unit=""), [1, 2], 1),
        (Wanted(tag="cold"), [3], 0),
        (Wanted(is_failed=True), [3], 0),
        (Wanted(rig="bench", is_failed=True), [], 0),
        (Wanted(since=found.sweeps[0].started_at), [1, 2, 3], 0),
        (Wanted(since=began_at), [3], 0),
        (Wanted(since=began_at + timedelta(microseconds=1)), [], 0),
    ):
        assert [row.id for row in found.sweeps if wanted.has_sweep(row)] == sweeps, wanted
        kept = [row for row in found.calibrations if wanted.has_calibration(row)]
        assert len(kept) == calibrations, wanted


def test_every_choice_is_an_option(rig: Command, bench: Store):
    words = ("--rig", "desk", "--unit", "B2", "--tag", "cold", "--since", "1d", "--failed")
    assert bench.exists
    assert [row["sweep"] for row in rig("history", "--json", *words).json["sweeps"]] == [3]
    since = ("--since", "2999-01-01T00:00+02:00")
    assert rig("history", "--json", *since).json["sweeps"] == []


def test_a_curve_that_missed_a_gate_counts_as_failed(rig: Command, bench: Store):
    bench.save_curve(1, curve={}, holdout={}, versions={}, active=False)
    found = rig("history", "--json", "--failed").json["sweeps"]
    assert [(row["sweep"], row["curve_active"]) for row in found] == [(1, False), (3, False)]


def test_who_and_with_what_is_listed(rig: Command, bench: Store):
    row = rig("history", "--json").json["sweeps"][2]
    assert {key: row[key] for key in ("unit", "note", "user", "host", "command", "tags")} == {
        "unit": "B2", "note": "after the fall", "user": "ada", "host": "bench-2",
        "command": "rig sweep desk", "tags": ["night", "cold"],
    }  # fmt: skip
    first = rig("history", "--json").json["sweeps"][0]
    assert first["devices"] == {"camera": {"serial": "A1"}}
    assert first["versions"] == {"rig": "1.0"}
    line = next(line for line in rig("history").out.splitlines() if "desk" in line)
    assert "after the fall #night #cold" in line
    assert bench.sweep(3).started_at.astimezone().strftime("%Y-%m-%d %H:%M %Z") in line


def test_a_damaged_row_is_named_and_hides_no_other(rig: Command, bench: Store, tmp_path: Path):
    bench.close()
    with closing(sqlite3.connect(tmp_path / "bench" / "rig.sqlite")) as connection:
        connection.execute("UPDATE sweeps SET profile = '[' WHERE id = 2")
        connection.execute("UPDATE calibrations SET created_at = 'today'")
        connection.execute("UPDATE curves SET holdout = '5'")
        connection.commit()
    found = rig("history", "--json").json
    assert [(row["sweep"], row["curve"]) for row in found["sweeps"]] == [(1, None), (3, None)]
    assert found["calibrations"] == []
    assert {(row["table"], row["row"]) for row in found["damaged"]} == {
        ("sweeps", "2"), ("calibrations", "1"), ("curves", "1"),
    }  # fmt: skip
    told = rig("history").err.splitlines()
    assert "rig: sweeps 2 is damaged and left out: profile: [, wanted is a JSON object" in told


def test_what_is_missing_on_the_disk_is_marked(rig: Command, bench: Store):
    shutil.rmtree(bench.samples(1)[0].folder)
    with bench.owned_sweep(2, "asked"):
        bench.mark_pruned(2)
    rows = rig("history", "--json").json["sweeps"]
    assert [(row["missing"], row["pruned"]) for row in rows] == [(1, 0), (0, 3), (0, 0)]
    lines = rig("history").out.splitlines()
    assert any("1 missing" in line for line in lines)
    assert any("3 pruned" in line for line in lines)


def test_a_time_that_is_none_is_refused(rig: Command):
    answer = rig("history", "--since", "soon")
    assert (answer.code, "write 2026-07-01" in answer.err) == (2, True)
