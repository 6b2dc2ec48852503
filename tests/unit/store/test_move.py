"""`rig store move` and `migrate`: all of it or nothing, and never under a program at work."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.database import open_store
from rig.database.copying import TABLES
from rig.database.location import locate
from rig.errors import OwnedError, StoreError
from rig.store.layout import MARK
from rig.store.migrate import migrate
from rig.store.move import move
from rig.store.verify import verify
from tests.support.kept_stores import CONCLUDED, FILES, SAMPLES, TAKEN, kept_store, sample_place
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import new_sweep, sqlite_url


def test_a_store_moves_with_its_frames_and_leaves_nothing(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        before = store.sweeps()
        (store.sweep(CONCLUDED).folder / "report.html").write_text("page")
        done = move(store, tmp_path / "b")
    assert (done.frames, done.left, done.copied.files) == (tmp_path / "b/frames", (), 2 * FILES)
    assert list((tmp_path / "a").iterdir()) == []
    with open_store(sqlite_url(tmp_path / "b")) as store:
        assert store.sweeps() == before
        assert verify(store).findings == ()
        sample = store.samples(TAKEN)[1]
        assert same_multiview(store.load(sample), noisy_multiview(21))
        assert (store.sweep(CONCLUDED).folder / "report.html").read_text() == "page"


def test_what_no_row_knows_stays_and_damage_comes_along(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        place = sample_place(store, TAKEN)
        (place / "left.png").write_bytes(b"damaged")
        (place.parent / "mine.txt").write_text("mine")
        done = move(store, tmp_path / "b")
    moved = tmp_path / "b" / place.relative_to(tmp_path / "a")
    assert (moved / "left.png").read_bytes() == b"damaged"
    assert done.left == (place.parent / "mine.txt",)
    assert [path for path in (tmp_path / "a").rglob("*") if path.is_file()] == list(done.left)


@pytest.mark.slow
def test_a_move_that_was_cut_short_goes_on(tmp_path: Path):
    def cut(count: int, _: str) -> None:
        if count == 4:
            raise KeyboardInterrupt

    with kept_store(tmp_path / "a") as store:
        with pytest.raises(KeyboardInterrupt):
            move(store, tmp_path / "b", cut)
        assert verify(store).findings == ()
        assert (tmp_path / "b" / "frames" / MARK).exists()
        with pytest.raises(StoreError, match="found the unfinished work"):
            other = tmp_path / "c"
            with kept_store(other) as second:
                move(second, tmp_path / "b")
        move(store, tmp_path / "b")
    with open_store(sqlite_url(tmp_path / "b")) as store:
        assert verify(store).findings == ()


def test_nothing_moves_under_a_program_at_work_and_nothing_begins_meanwhile(tmp_path: Path):
    with kept_store(tmp_path / "a") as store, open_store(sqlite_url(tmp_path / "a")) as other:
        with (
            other.owned_sweep(TAKEN, "asked"),
            pytest.raises(OwnedError, match="asked to move the store, but sweep 2 is at work"),
        ):
            move(store, tmp_path / "b")
        assert verify(store).findings == ()

        def meanwhile(count: int, _: str) -> None:
            if count == 1:
                with pytest.raises(OwnedError, match="asked to begin a sweep of bench"):
                    new_sweep(other)
                with (
                    pytest.raises(OwnedError, match="asked to resume it, it belongs to process"),
                    other.owned_sweep(TAKEN, "asked to resume it"),
                ):
                    pass

        move(store, tmp_path / "b", meanwhile)
        with pytest.raises(StoreError, match="the database is gone"):
            new_sweep(other)


def test_a_move_needs_an_empty_place_outside(tmp_path: Path):
    with kept_store(tmp_path / "a") as store, kept_store(tmp_path / "b"):
        with pytest.raises(StoreError, match=r"asked for an empty place, found .*rig.sqlite there"):
            move(store, tmp_path / "b")
        with pytest.raises(StoreError, match="it is inside of the frames"):
            move(store, store.frames / "b")
        assert verify(store).findings == ()


def test_all_rows_migrate_and_the_old_ones_stay(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        there = replace(locate(sqlite_url(tmp_path / "b"), {}), frames=store.frames)
        done = migrate(store, there)
        assert done.copied is None
        assert done.rows == {
            "calibrations": 1, "sweeps": 2, "curves": 1, "stops": 6, "samples": 2 * SAMPLES,
            "frames": 2 * FILES, "measurements": 0, "drifts": 0,
        }  # fmt: skip
        assert set(done.rows) == {table.name for table in TABLES}
        assert verify(store).findings == ()
        with pytest.raises(StoreError, match="into an empty database, found rows in it"):
            migrate(store, there)
    with open_store(sqlite_url(tmp_path / "b")) as copy:
        assert [row.id for row in copy.sweeps()] == [1, 2]
        assert copy.active_curve("bench").curve == {"a": 0.1 + 0.2}
        assert new_sweep(copy) == 3


@pytest.mark.slow
def test_frames_come_along_where_that_is_asked(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        there = locate(sqlite_url(tmp_path / "b"), {})
        with pytest.raises(StoreError, match=r"would look for frames in .*/b/frames, they are in"):
            migrate(store, there)
        assert not (tmp_path / "b").exists()
        done = migrate(store, there, copies_frames=True)
        assert done.copied is not None
        assert done.copied.files == 2 * FILES
        with pytest.raises(StoreError, match="into itself"):
            migrate(store, store.location)
    with open_store(sqlite_url(tmp_path / "b")) as copy:
        assert verify(copy).findings == ()


def test_a_migration_that_was_cut_short_leaves_no_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    from rig.database import copying

    def cut(*_: object) -> None:
        raise KeyboardInterrupt

    with kept_store(tmp_path / "a") as store:
        there = replace(locate(sqlite_url(tmp_path / "b"), {}), frames=store.frames)
        monkeypatch.setattr(copying, "_digest", cut)  # all rows are written by then
        with pytest.raises(KeyboardInterrupt):
            migrate(store, there)
        monkeypatch.undo()
        with open_store(sqlite_url(tmp_path / "b")) as target:
            assert target.is_empty()
        assert sum(migrate(store, there).rows.values()) == 34


@pytest.mark.slow
def test_rows_that_come_back_otherwise_are_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    from rig.database import copying

    with kept_store(tmp_path / "a") as store:
        there = replace(locate(sqlite_url(tmp_path / "b"), {}), frames=store.frames)
        seen = iter(range(99))
        monkeypatch.setattr(copying, "_digest", lambda *_: (5, str(next(seen))))
        with pytest.raises(StoreError, match=r"calibrations came back otherwise than they were"):
            migrate(store, there)
        with open_store(sqlite_url(tmp_path / "b")) as target:
            assert target.is_empty()
