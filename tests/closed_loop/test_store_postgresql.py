"""`rig store` on a real PostgreSQL server: there, back, and what is the same on both sides."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rig.database import open_store
from rig.database.location import Location, locate
from rig.errors import OwnedError, StoreError
from rig.store.backup import back_up
from rig.store.migrate import migrate
from rig.store.move import move
from rig.store.prune import PruneRequest, prunable, prune
from rig.store.repair import repair
from rig.store.restore import restore
from rig.store.verify import verify
from tests.support.kept_stores import CONCLUDED, FILES, SAMPLES, TAKEN, kept_store, sample_place
from tests.support.multiviews import noisy_multiview
from tests.support.postgresql import postgresql_server
from tests.support.stores import STOPS, new_sweep, sqlite_url

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with postgresql_server() as address:
        yield address


def test_a_store_goes_to_a_server_works_there_and_comes_back(
    server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    frames = tmp_path / "a" / "frames"
    monkeypatch.setenv("RIG_FRAMES", str(frames))
    with kept_store(tmp_path / "a") as store:
        done = migrate(store, locate(server, {"RIG_FRAMES": str(frames)}))
        assert sum(done.rows.values()) == 34
        before = store.history(store.frames)
    with open_store(server) as store, open_store(server) as other:
        assert store.history(store.frames) == before
        assert verify(store).findings == ()
        number = new_sweep(store)
        assert number == 3  # the server counts on
        store.add_sample(number, stop=0, number=0, reached_mm=1.0, multiview=noisy_multiview(5))
        with store.owned_sweep(number, "asked"):
            with pytest.raises(OwnedError, match="asked to migrate the store, but sweep 3"):
                migrate(other, _sqlite(tmp_path / "b", frames))
            assert back_up(other, tmp_path / "backup").samples == 2 * SAMPLES + 1
        sample = sample_place(store, TAKEN)
        (sample.parent / "sample_08").mkdir()
        (store.frames / "bench" / "77_20260101-000000").mkdir()
        found = verify(store)
        assert sorted(f.kind for f in found.findings) == ["orphan", "orphan"]
        assert len(repair(store, found.findings).done) == 2
        prune(store, prunable(store, PruneRequest(verdict="passed")))
        found = verify(store)
        assert (found.findings, found.pruned, found.files) == ((), SAMPLES, FILES + 3)
        back = migrate(other, _sqlite(tmp_path / "b", frames))
        assert back.rows["samples"] == 2 * SAMPLES + 1
    with open_store(sqlite_url(tmp_path / "b")) as store:
        assert verify(store).findings == ()
        assert store.curve(1).curve == {"a": 0.1 + 0.2}
        assert new_sweep(store) == 4


def test_a_backup_of_a_server_comes_back_into_an_empty_one_only(
    server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path / "frames"))
    with open_store(server) as store:
        rows = store.history(store.frames).sweeps
        monkeypatch.delenv("RIG_FRAMES")
        with kept_store(tmp_path / "a") as other:
            back_up(other, tmp_path / "backup")
        place = replace(locate(server, {}), frames=tmp_path / "frames")
        with pytest.raises(StoreError, match="found a database with rows in it"):
            restore(tmp_path / "backup", place)
        assert store.history(store.frames).sweeps == rows
    _emptied(server)
    done = restore(tmp_path / "backup", place)
    assert done.copied.files == 2 * FILES
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path / "frames"))
    with open_store(server) as store:
        assert verify(store).findings == ()
        assert len(store.samples(CONCLUDED)) == len(STOPS)
        moved = move(store, tmp_path / "elsewhere")
        assert moved.frames == tmp_path / "elsewhere" / "frames"
    monkeypatch.setenv("RIG_FRAMES", str(moved.frames))
    with open_store(server) as store:
        assert verify(store).findings == ()


def _sqlite(folder: Path, frames: Path) -> Location:
    return replace(locate(sqlite_url(folder), {}), frames=frames)


def _emptied(server: str) -> None:
    from sqlalchemy import create_engine, text

    engine = create_engine(server)
    with engine.begin() as connection:
        connection.execute(text("DROP SCHEMA public CASCADE"))
        connection.execute(text("CREATE SCHEMA public"))
    engine.dispose()
