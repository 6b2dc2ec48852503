"""`rig store backup` and `restore`: the same rows and the same images, at another place."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from rig.calibrate.album import Album
from rig.calibrate.pictures import Picture
from rig.database import Store, open_store
from rig.database.location import locate
from rig.errors import OwnedError, StoreError
from rig.profile.load import load_profile
from rig.store.backup import back_up
from rig.store.layout import MARK
from rig.store.manifest import FILE, read_manifest, write_manifest
from rig.store.restore import restore
from rig.store.verify import verify
from tests.support.kept_stores import CONCLUDED, FILES, SAMPLES, TAKEN, kept_store, sample_place
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import new_sweep, sqlite_url


def contents(store: Store) -> object:
    """Return all that a store keeps, as values."""
    numbers = [row.id for row in store.sweeps()]
    return (
        [replace(store.sweep(n), folder=Path()) for n in numbers],
        [[replace(s, folder=Path()) for s in store.samples(n)] for n in numbers],
        [store.measurements(n) for n in numbers],
        store.calibrations(),
        store.active_curve("bench"),
    )


def test_a_backup_comes_back_as_it_was(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        album = Album.new(store.frames, load_profile("sim"))
        album.keep(Picture(0, noisy_multiview(3)))
        (store.sweep(CONCLUDED).folder / "report.html").write_text("page")
        made = back_up(store, tmp_path / "b")
        assert (made.sweeps, made.samples, made.files) == (2, 2 * SAMPLES, 2 * FILES + 3)
        assert (made.bad, made.is_whole, len(made.sha256)) == ((), True, 1)
        assert store.owners() == {}
        before = contents(store)
    done = restore(tmp_path / "b", locate(sqlite_url(tmp_path / "c"), {}))
    assert (done.copied.new, done.copied.bad) == (2 * FILES + 3, [])
    with open_store(sqlite_url(tmp_path / "c")) as store:
        assert contents(store) == before
        assert verify(store).findings == ()
        for sample in store.samples(TAKEN):
            assert same_multiview(store.load(sample), noisy_multiview(20 + sample.stop.index))
        assert (store.sweep(CONCLUDED).folder / "report.html").read_text() == "page"
        place = store.frames / album.folder.relative_to(tmp_path / "a" / "frames")
        (picture,) = Album(place, store.modes).pictures()
        assert same_multiview(picture.multiview, noisy_multiview(3))
    assert sorted(p.name for p in (tmp_path / "c").iterdir()) == ["frames", "rig.sqlite"]


@pytest.mark.slow
def test_a_second_backup_copies_what_is_new_only(tmp_path: Path):
    told: list[str] = []
    with kept_store(tmp_path / "a") as store:
        back_up(store, tmp_path / "b")
        number = new_sweep(store)
        store.add_sample(number, stop=0, number=0, reached_mm=1.0, multiview=noisy_multiview(7))
        untouched = sample_place(store, TAKEN) / "left.png"
        copy = tmp_path / "b" / untouched.relative_to(tmp_path / "a")
        before = copy.stat()
        assert back_up(store, tmp_path / "b", lambda _, place: told.append(place)).sweeps == 3
        assert copy.stat().st_mtime_ns == before.st_mtime_ns
    assert len(told) == 2 * SAMPLES + 1
    with open_store(sqlite_url(tmp_path / "b")) as store:  # a backup is a store
        assert [row.id for row in store.sweeps()] == [1, 2, 3]
        assert verify(store).damage == ()


def test_a_backup_while_a_sweep_runs_holds_what_is_stored_and_no_owner(tmp_path: Path):
    with kept_store(tmp_path / "a") as store, open_store(sqlite_url(tmp_path / "a")) as running:
        number = new_sweep(running)
        with running.owned_sweep(number, "asked"):
            running.add_sample(
                number, stop=0, number=0, reached_mm=1.0, multiview=noisy_multiview(7)
            )

            def meanwhile(count: int, _: str) -> None:
                if count == 1:
                    running.add_sample(
                        number, stop=0, number=1, reached_mm=1.0, multiview=noisy_multiview(8)
                    )

            assert back_up(store, tmp_path / "b", meanwhile).samples == 2 * SAMPLES + 1
    with open_store(sqlite_url(tmp_path / "b")) as copy:
        assert copy.owners() == {}
        assert len(copy.samples(number)) == 1
        assert verify(copy).findings == ()


def test_what_is_damaged_is_told_and_the_rest_copied(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        place = sample_place(store, TAKEN)
        (place / "left.png").write_bytes(b"no picture")
        (place / "top.png").unlink()
        made = back_up(store, tmp_path / "b")
        where = place.relative_to(store.frames).as_posix()
    assert set(made.bad) == {
        f"{where}/left.png: damaged (10 bytes, wrong SHA-256)",
        f"{where}/top.png: missing",
    }
    assert made.files == 2 * FILES - 2


@pytest.mark.slow
def test_a_damaged_copy_is_made_anew(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        back_up(store, tmp_path / "b")
        image = sample_place(store, TAKEN) / "left.png"
        copy = tmp_path / "b" / image.relative_to(tmp_path / "a")
        copy.write_bytes(b"x")
        back_up(store, tmp_path / "b")
        assert copy.read_bytes() == image.read_bytes()


@pytest.mark.slow
def test_a_backup_goes_into_an_empty_folder_or_its_own(tmp_path: Path):
    with kept_store(tmp_path / "a") as store, kept_store(tmp_path / "other") as other:
        back_up(store, tmp_path / "b")
        with pytest.raises(
            StoreError, match=r"asked for a backup of .*other.*, found one of .*/a/"
        ):
            back_up(other, tmp_path / "b")
        (tmp_path / "full").mkdir()
        (tmp_path / "full" / "thesis.tex").touch()
        with pytest.raises(StoreError, match=r"found thesis.tex there; choose a new or an empty"):
            back_up(store, tmp_path / "full")
        with pytest.raises(StoreError, match=r"is inside of the frames"):
            back_up(store, store.frames / "b")
        with (
            other.owned("frames", other.frames, "asked"),
            pytest.raises(OwnedError, match="asked to make a backup, it belongs to process"),
            open_store(sqlite_url(tmp_path / "other")) as third,
        ):
            back_up(third, tmp_path / "d")


@pytest.mark.slow
def test_an_unfinished_or_damaged_backup_is_not_restored(tmp_path: Path):
    target = locate(sqlite_url(tmp_path / "c"), {})
    with pytest.raises(StoreError, match="asked to restore a backup, found none"):
        restore(tmp_path, target)
    with kept_store(tmp_path / "a") as store:
        made = back_up(store, tmp_path / "b")
    write_manifest(tmp_path / "b", replace(made, is_whole=False), 0o600)
    with pytest.raises(StoreError, match="found one that is unfinished"):
        restore(tmp_path / "b", target)
    write_manifest(tmp_path / "b", replace(made, sha256=("0" * 64, *made.sha256)), 0o600)
    assert restore(tmp_path / "b", target).manifest.samples == 2 * SAMPLES
    with (tmp_path / "b" / "rig.sqlite").open("ab") as file:
        file.write(b"x")
    with pytest.raises(StoreError, match="is damaged, or was changed after the backup"):
        restore(tmp_path / "b", locate(sqlite_url(tmp_path / "d"), {}))
    assert not (tmp_path / "d").exists()


def test_a_manifest_that_is_none_is_refused(tmp_path: Path):
    (tmp_path / FILE).write_text('{"version": 1}')
    with pytest.raises(StoreError, match="a stored backup is ill-formed: source is missing"):
        read_manifest(tmp_path)
    (tmp_path / FILE).write_text(" " * 1_000_001)
    with pytest.raises(StoreError, match="larger than 1000000 bytes"):
        read_manifest(tmp_path)


def test_a_backup_is_restored_into_an_empty_place_only(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        back_up(store, tmp_path / "b")
    with pytest.raises(StoreError, match=r"asked for an empty place, found .*rig.sqlite there"):
        restore(tmp_path / "b", locate(sqlite_url(tmp_path / "a"), {}))
    (tmp_path / "c" / "frames" / "bench").mkdir(parents=True)
    with pytest.raises(StoreError, match="found bench in"):
        restore(tmp_path / "b", locate(sqlite_url(tmp_path / "c"), {}))
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "rig.sqlite-wal").write_bytes(b"rest")  # SQLite would read it
    with pytest.raises(StoreError, match=r"rig.sqlite-wal there"):
        restore(tmp_path / "b", locate(sqlite_url(tmp_path / "d"), {}))


def test_a_restore_that_was_cut_short_goes_on(tmp_path: Path):
    with kept_store(tmp_path / "a") as store:
        back_up(store, tmp_path / "b")
    target = locate(sqlite_url(tmp_path / "c"), {})

    def cut(count: int, _: str) -> None:
        if count == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        restore(tmp_path / "b", target, cut)
    assert not (tmp_path / "c" / "rig.sqlite").exists()
    assert json.loads((target.frames / MARK).read_text())["restores"] == str(tmp_path / "b")
    shutil.copytree(tmp_path / "b", tmp_path / "b2")
    with pytest.raises(StoreError, match="found the unfinished work"):
        restore(tmp_path / "b2", target)
    done = restore(tmp_path / "b", target)
    assert (done.copied.files, done.copied.new) == (2 * FILES, 2 * FILES - 6)
    assert not (target.frames / MARK).exists()
