"""One owner per sweep: who is refused, who takes over, and who stores nothing any more."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import create_engine, update
from sqlalchemy.orm import Session

from rig.database import Store, open_store
from rig.database.heartbeat import Heartbeat
from rig.database.leases import STALE_S, sweep_lease
from rig.database.tables import LeaseRow
from rig.errors import OwnedError, StoreError
from rig.folder_lock import LOCK_FILE
from rig.owner import Owner
from tests.support.multiviews import noisy_multiview
from tests.support.stores import new_sweep, sqlite_url

NOON = datetime(2026, 7, 1, 12, 0, 0, tzinfo=UTC)
ELSEWHERE = Owner("e" * 32, "other-bench", 4711, "another-boot 1 99", NOON)


class Clock:
    """The time of a database, as a test wants it."""

    def __init__(self) -> None:
        self.now = NOON

    def __call__(self, _: Session) -> datetime:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(tmp_path: Path, clock: Clock) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path), now=clock) as opened:
        yield opened


@pytest.fixture
def second(tmp_path: Path, store: Store, clock: Clock) -> Iterator[Store]:
    """Another program's view of the same database."""
    assert store.exists
    with open_store(sqlite_url(tmp_path), now=clock) as opened:
        yield opened


def put_lease(tmp_path: Path, sweep_id: int, owner: Owner, heartbeat: datetime = NOON) -> None:
    engine = create_engine(sqlite_url(tmp_path))
    with Session(engine) as session, session.begin():
        session.merge(
            LeaseRow(
                what=sweep_lease(sweep_id),
                token=owner.token,
                host=owner.host,
                pid=owner.pid,
                process=owner.process,
                since=owner.since,
                heartbeat=heartbeat,
            )
        )
    engine.dispose()


def add(store: Store, sweep_id: int, number: int = 0) -> None:
    store.add_sample(
        sweep_id, stop=0, number=number, reached_mm=1.0, multiview=noisy_multiview(number)
    )


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_second_owner_is_told_the_first_and_changes_nothing(store: Store, second: Store):
    sweep_id = new_sweep(store)
    folder = store.sweep(sweep_id).folder
    half = folder / "stop_000_0400.0mm_forward" / ".sample_00.0a1b.tmp"
    half.mkdir(parents=True)
    (half / "left.png").write_bytes(b"half")
    with store.owned_sweep(sweep_id, "asked to take it"):
        before, row = files(folder), store.sweep(sweep_id)
        with (
            pytest.raises(OwnedError) as refused,
            second.owned_sweep(sweep_id, "asked to resume sweep 1"),
        ):
            pytest.fail("two owners")
        assert (files(folder), store.sweep(sweep_id)) == (before, row)
    text = str(refused.value)
    assert text.startswith("asked to resume sweep 1, it belongs to process ")
    assert f"process {os.getpid()} on {os.uname().nodename}, since 2026-07-01 12:00:00 UTC" in text
    assert text.endswith("; let it end, or stop it there")


def test_whoever_is_not_the_owner_writes_nothing(store: Store, second: Store):
    sweep_id = new_sweep(store)
    with store.owned_sweep(sweep_id, "asked"):
        add(store, sweep_id)
        for write in (
            lambda: add(second, sweep_id, 1),
            lambda: second.reopen_sweep(sweep_id),
            lambda: second.stop_sweep(sweep_id, failed=True),
            lambda: second.save_measurements(sweep_id, {}),
            lambda: second.replace_measurements(sweep_id, {}, calibration_id=None),
            lambda: second.save_curve(sweep_id, curve={}, holdout={}, versions={}),
        ):
            with pytest.raises(OwnedError, match="asked to change sweep 1, it belongs to process"):
                write()
        assert len(second.samples(sweep_id)) == 1
        assert second.sweeps()[0].curve_id is None
    add(second, sweep_id, 1)
    assert len(store.samples(sweep_id)) == 2


def test_an_owner_that_ended_leaves_nothing_behind(store: Store, second: Store):
    sweep_id = new_sweep(store)
    lock = store.sweep(sweep_id).folder / LOCK_FILE
    with store.owned_sweep(sweep_id, "asked"):
        held = Owner.from_json(lock.read_text())
        assert held == second.owner(sweep_lease(sweep_id))
        assert second.sweeps()[0].at_work == str(held)
        with store.owned_sweep(sweep_id, "asked once more inside"):
            assert lock.exists()
        assert lock.exists()
    assert not lock.exists()
    assert second.owner(sweep_lease(sweep_id)) is None
    assert second.sweeps()[0].at_work is None
    with second.owned_sweep(sweep_id, "asked"):
        assert second.owner(sweep_lease(sweep_id)) != held


def test_a_dead_process_of_this_machine_is_taken_over_at_once(store: Store, tmp_path: Path):
    sweep_id = new_sweep(store)
    me = Owner.this_program(NOON)
    with subprocess.Popen(["sleep", "60"]) as process:
        living = replace(me, pid=process.pid, process=_identity(process.pid))
        put_lease(tmp_path, sweep_id, living)
        assert living.is_gone is False
        with pytest.raises(OwnedError, match=f"process {process.pid} on"):
            add(store, sweep_id)
        process.kill()
    assert living.is_gone is True
    assert store.owner(sweep_lease(sweep_id)) is None
    with store.owned_sweep(sweep_id, "asked"):
        add(store, sweep_id)
    assert len(store.samples(sweep_id)) == 1


def _identity(pid: int) -> str:
    from rig.owner import process_identity

    found = process_identity(pid)
    assert found is not None
    return found


def test_another_process_with_the_number_of_a_dead_one_is_not_it(store: Store, tmp_path: Path):
    sweep_id = new_sweep(store)
    me = Owner.this_program(NOON)
    boot, space, started = me.process.split()
    put_lease(tmp_path, sweep_id, replace(me, process=f"{boot} {space} {int(started) - 1}"))
    with store.owned_sweep(sweep_id, "asked"):
        assert store.owner(sweep_lease(sweep_id)) is not None


def test_another_machine_is_believed_until_it_was_silent_for_too_long(
    store: Store, clock: Clock, tmp_path: Path
):
    sweep_id = new_sweep(store)
    put_lease(tmp_path, sweep_id, ELSEWHERE)
    clock.now = NOON + timedelta(seconds=STALE_S)
    with (
        pytest.raises(OwnedError, match="4711 on other-bench") as refused,
        store.owned_sweep(sweep_id, "asked to resume sweep 1"),
    ):
        pytest.fail("two owners")
    assert refused.value.advice == (
        "let it end, or stop it there; if that machine is off, try again 120 s after 12:00:00 UTC, "
        "when it was last heard of"
    )
    assert store.sweeps()[0].at_work == str(ELSEWHERE)
    clock.now += timedelta(milliseconds=1)
    assert store.sweeps()[0].at_work is None
    with store.owned_sweep(sweep_id, "asked"):
        owner = store.owner(sweep_lease(sweep_id))
    assert owner is not None
    assert owner.pid == os.getpid()


def test_an_owner_that_was_taken_for_dead_stores_nothing_any_more(
    store: Store, second: Store, tmp_path: Path
):
    sweep_id = new_sweep(store)
    with store.owned_sweep(sweep_id, "asked"):
        add(store, sweep_id)
        put_lease(tmp_path, sweep_id, ELSEWHERE)
        with pytest.raises(OwnedError, match="go on with sweep 1, it belongs to process 4711"):
            add(store, sweep_id, 1)
        assert len(second.samples(sweep_id)) == 1
        with pytest.raises(OwnedError, match="not heard of for too long; look at rig history"):
            store.save_curve(sweep_id, curve={}, holdout={}, versions={})
    assert second.owner(sweep_lease(sweep_id)) == ELSEWHERE


def test_a_lease_that_nobody_has_any_more_is_no_lease(store: Store, tmp_path: Path):
    sweep_id = new_sweep(store)
    with store.owned_sweep(sweep_id, "asked"):
        engine = create_engine(sqlite_url(tmp_path))
        with Session(engine) as session, session.begin():
            session.execute(update(LeaseRow).values(what="sweep 99"))
        engine.dispose()
        with pytest.raises(OwnedError, match="it belongs to nobody: its lease was taken away"):
            add(store, sweep_id)
    assert store.samples(sweep_id) == ()


def test_every_sample_is_a_sign_of_life(store: Store, clock: Clock, tmp_path: Path):
    sweep_id = new_sweep(store)
    with store.owned_sweep(sweep_id, "asked"):
        clock.now = NOON + timedelta(hours=1)
        add(store, sweep_id)
        engine = create_engine(sqlite_url(tmp_path))
        with Session(engine) as session:
            (row,) = session.query(LeaseRow).all()
            assert (row.since, row.heartbeat) == (NOON, clock.now)
        engine.dispose()


def test_two_databases_with_one_folder_of_frames_are_told_apart_by_its_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path / "frames"))
    with (
        open_store(f"sqlite:///{tmp_path}/a.sqlite") as first,
        open_store(f"sqlite:///{tmp_path}/b.sqlite") as second,
    ):
        here, there = new_sweep(first), new_sweep(second, rig="other")
        with ExitStack() as stack:
            stack.enter_context(first.owned_sweep(here, "asked"))
            folder = first.sweep(here).folder
            with pytest.raises(OwnedError, match=f"asked for {folder}, it belongs to process"):
                stack.enter_context(second.owned("sweep 7", folder, "asked"))
            assert second.owner("sweep 7") is None
            stack.enter_context(second.owned_sweep(there, "asked"))
            assert second.owner(sweep_lease(there)) is not None


def test_a_folder_that_went_away_is_noticed_at_the_next_sample(store: Store):
    sweep_id = new_sweep(store)
    folder = store.sweep(sweep_id).folder
    with store.owned_sweep(sweep_id, "asked"):
        add(store, sweep_id)
        folder.rename(folder.with_name("elsewhere"))
        with pytest.raises(StoreError, match=r"the folder is gone, .*; bring it back and go on"):
            add(store, sweep_id, 1)
        assert not folder.exists(), "what is written into an empty mount point is lost"
        folder.mkdir()  # what is left when a disk is unmounted
        with pytest.raises(StoreError, match="the folder is gone, or another one is at its place"):
            add(store, sweep_id, 1)
        assert list(folder.iterdir()) == []
        folder.rmdir()
        folder.with_name("elsewhere").rename(folder)
        add(store, sweep_id, 1)
    assert len(store.samples(sweep_id)) == 2


def test_a_database_that_went_away_is_noticed_at_the_next_sample(store: Store, tmp_path: Path):
    sweep_id = new_sweep(store)
    add(store, sweep_id)
    file = tmp_path / "rig.sqlite"
    file.rename(tmp_path / "gone.sqlite")
    with pytest.raises(StoreError, match="the database is gone, or another one is at its place"):
        add(store, sweep_id, 1)
    file.write_bytes(b"")
    with pytest.raises(StoreError, match="the database is gone, or another one is at its place"):
        store.sweeps()
    (tmp_path / "gone.sqlite").rename(file)
    add(store, sweep_id, 1)
    assert len(store.samples(sweep_id)) == 2


def test_a_heart_beats_until_it_is_of_no_use():
    beats: list[int] = []
    over = threading.Event()

    def beat() -> bool:
        beats.append(len(beats))
        if len(beats) == 2:
            raise StoreError("the database cannot be reached", advice="wait")
        if len(beats) < 4:
            return True
        over.set()
        return False

    with Heartbeat(beat, 0.001):
        assert over.wait(30.0)
    assert beats == [0, 1, 2, 3]


HOLD = """
import sys
from rig.database import open_store
with open_store(sys.argv[1]) as store, store.owned_sweep(1, "asked"):
    print("owns", flush=True)
    sys.stdin.read()
"""


def test_a_killed_owner_is_followed_at_once(store: Store, tmp_path: Path):
    sweep_id = new_sweep(store)
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, sqlite_url(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "owns\n"
        with pytest.raises(OwnedError, match=f"process {process.pid} on"):
            add(store, sweep_id)
        process.kill()
    lock = store.sweep(sweep_id).folder / LOCK_FILE
    assert lock.exists()
    with store.owned_sweep(sweep_id, "asked"):
        add(store, sweep_id)
    assert not lock.exists()
