"""`rig history`: what is stored of every sweep, and what to do next."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from rig.cli.history import next_step
from rig.database import open_store
from rig.records import HistoryRow, State
from tests.support.command import Command
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
