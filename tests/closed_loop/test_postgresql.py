"""A store on a real PostgreSQL server: several programs at once, restarts, silence, refusals."""

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import create_engine, text

from rig.database import Store, open_store
from rig.database import frames as database_frames
from rig.database import postgresql as door
from rig.errors import StoreError
from tests.support.command import Command
from tests.support.multiviews import noisy_multiview
from tests.support.postgresql import Server, running_server
from tests.support.small_sim import as_options
from tests.support.stores import STOPS, new_sweep

pytestmark = pytest.mark.slow

GONE = "the server does not answer"
SWEEP = ("sweep", "sim", "--at-mm", "420,500,600,700,850,1000,1180", "--samples", "1")


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running_server() as started:
        yield started


@pytest.fixture
def store(server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path / "frames"))
    with open_store(server.url) as opened:
        yield opened


def test_programs_that_open_a_new_database_together_all_open_it(server: Server):
    url = server.make_database("fresh")
    command = [sys.executable, "-c", f"import rig.database as d; d.open_store({url!r}).close()"]
    programs = [
        subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    answers = [program.communicate(timeout=120) for program in programs]
    assert [program.returncode for program in programs] == [0] * 4, answers
    with open_store(url) as opened:
        assert opened.sweeps() == ()


def test_a_restart_between_two_samples_is_not_noticed(store: Store, server: Server):
    sweep_id = new_sweep(store, samples_per_stop=1)
    with store.owned_sweep(sweep_id, "asked"):
        for stop in STOPS:
            multiview = noisy_multiview(stop.index)
            store.add_sample(
                sweep_id, stop=stop.index, number=0, reached_mm=1.0, multiview=multiview
            )
            server.restart()
    assert store.sweep(sweep_id).state == "taken"
    assert len(store.samples(sweep_id)) == len(STOPS)
    assert store.owners() == {}


def test_a_server_that_is_down_is_told_and_waited_for(
    store: Store, server: Server, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(door, "RETURN_S", 0.5)
    server.stop()
    try:
        with pytest.raises(StoreError, match=GONE) as caught:
            store.sweeps()
        with pytest.raises(StoreError, match=GONE):  # never there before: not waited for
            open_store(server.url)
    finally:
        server.start()
    assert "a sweep goes on with --resume" in caught.value.advice
    assert isinstance(store.sweeps(), tuple)
    server.stop()
    monkeypatch.setattr(door, "RETURN_S", 60.0)
    starting = threading.Timer(1.0, server.start)
    starting.start()
    try:
        assert isinstance(store.sweeps(), tuple)
    finally:
        starting.join()


def test_a_silent_server_is_given_up(store: Store, server: Server, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(door, "SILENCE_S", 1.0)
    monkeypatch.setattr(door, "CONNECT_S", 2)
    monkeypatch.setattr(door, "RETURN_S", 0.0)
    assert isinstance(store.sweeps(), tuple)
    with server.frozen():
        began_s = time.monotonic()
        with pytest.raises(StoreError, match=GONE):
            store.sweeps()
        with pytest.raises(StoreError, match=GONE):
            open_store(server.url)
        assert time.monotonic() - began_s < 30.0
    assert isinstance(store.sweeps(), tuple)


def test_a_statement_that_takes_too_long_is_ended(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(door, "STATEMENT_S", 1)
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path))
    other = create_engine(server.url)
    with open_store(server.url) as store:
        sweep_id = new_sweep(store)
        with other.begin() as connection:
            connection.execute(text("LOCK TABLE sweeps"))
            with pytest.raises(StoreError, match="did not end a statement in time") as caught:
                store.sweep(sweep_id)
        assert "try again" in caught.value.advice
        assert store.sweep(sweep_id).id == sweep_id
    other.dispose()


def test_what_the_server_refuses_is_told_in_its_words(server: Server):
    with pytest.raises(StoreError, match='the server answers: database "none" does not exist'):
        open_store(server.url.replace("/rig?", "/none?"))
    with pytest.raises(StoreError, match='the server answers: role "nobody" does not exist'):
        open_store(server.url.replace("rig@", "nobody@"))
    with pytest.raises(StoreError, match="cannot begin a sweep"), open_store(server.url) as store:
        new_sweep(store, rig="a\x00b")


def test_a_restart_under_every_verb(
    rig: Command, server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    url = server.make_database("verbs")
    monkeypatch.setenv("RIG_DATABASE", url)
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path / "frames"))
    published: list[int] = []
    publish = database_frames.FrameWriter.publish

    def restart_in_between(writer: Any) -> None:
        published.append(len(published))
        if len(published) == 4:  # in the middle of the transaction of a sample
            server.restart()
        publish(writer)

    monkeypatch.setattr(database_frames.FrameWriter, "publish", restart_in_between)
    broken = rig(*SWEEP, *as_options())
    assert broken.code == 1
    last = broken.err.strip().splitlines()[-1]
    assert last.startswith("rig: ")
    assert "Traceback" not in broken.err
    assert "ended early" in broken.err
    resumed = rig("sweep", "sim", "--resume", "--json", *as_options())
    assert resumed.code in (0, 3), resumed.err
    points = resumed.json["points"]
    assert len(points) == 9
    assert all(point["samples"] == 1 for point in points)
    export = ("export", "1", "--format", "csv", "--out", tmp_path / "samples.csv")
    for verb in (("history",), ("report", "1"), ("fit", "1"), export):
        server.restart()
        answer = rig(*verb)
        assert answer.code in (0, 3), answer.err
