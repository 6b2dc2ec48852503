"""What is known of a scan comes back with its pictures."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.calibrate.album import Album
from rig.calibrate.pictures import Picture
from rig.database import open_store
from rig.database.frames import FrameWriter, read_frames
from rig.database.location import locate
from rig.database.scan_files import FACTS
from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.profile.load import load_profile
from rig.scan import Scan, ScanFacts, ScanTimes, Take
from rig.store.backup import back_up
from rig.store.move import move
from rig.store.restore import restore
from rig.store.verify import verify
from tests.support.multiviews import noisy_multiview
from tests.support.stores import new_sweep, sqlite_url

SCAN = Scan(
    ScanFacts(
        (
            Take("centre", "view", 0.1 / 3.0, None, 1e5 / 3.0, 0, None),
            Take("left", "view", -20.0, 4.0, 1e5, 1, 30.1, 1.02, -0.1),
            Take("centre", "last", 0.0, None, 1e5, 1, None, 0.98),
        ),
        ScanTimes(1.0, 2.0, 3.0, 6.6),
    )
)


def test_a_sample_that_is_a_scan_comes_back_as_one(tmp_path: Path):
    taken = replace(noisy_multiview(1), scan=SCAN)
    with open_store(sqlite_url(tmp_path)) as store:
        number = new_sweep(store)
        sample = store.add_sample(number, stop=0, number=0, reached_mm=400.0, multiview=taken)
        loaded = store.load(sample)
        assert loaded.scan is not None
        assert loaded.scan.facts == SCAN.facts
        assert loaded.skew_s == 0.0
        assert sample.folder.joinpath(FACTS).is_file()


def test_other_samples_have_no_such_file_and_damage_is_told(tmp_path: Path):
    with FrameWriter(tmp_path / "sample", tmp_path, FileModes()) as writer:
        stored = writer.write(noisy_multiview(1))
        writer.publish()
    assert read_frames(tmp_path / "sample", stored, None).scan is None
    (tmp_path / "sample" / FACTS).write_text("{}")
    with pytest.raises(StoreError, match="stored scan"):
        read_frames(tmp_path / "sample", stored, None)


def test_facts_of_a_scan_tell_places_light_and_time():
    assert SCAN.facts.positions_mm == {"centre": (0.1 / 3.0, None), "left": (-20.0, 4.0)}
    assert SCAN.facts.brightness_drift == pytest.approx(1.02 / 0.98 - 1.0)
    assert SCAN.facts.times.needed_s == 6.0


TAKEN = replace(noisy_multiview(1), scan=SCAN)


def store_of_scans(folder: Path) -> Path:
    """Keep one scan of a sweep and one of a calibration; return the album."""
    with open_store(sqlite_url(folder)) as store:
        store.add_sample(new_sweep(store), stop=0, number=0, reached_mm=400.0, multiview=TAKEN)
        album = Album.new(store.frames, load_profile("sim"))
        album.keep(Picture(0, TAKEN))
        return album.folder.relative_to(store.frames)


def assert_scans_are_kept(folder: Path, album: Path) -> None:
    with open_store(sqlite_url(folder)) as store:
        (sample,) = store.samples(1)
        (picture,) = Album(store.frames / album, store.modes).pictures()
        for multiview in (store.load(sample), picture.multiview):
            assert multiview.scan is not None
            assert multiview.scan.facts == SCAN.facts
        assert not [f for f in verify(store).findings if f.kind != "lease"]


def test_a_backup_brings_scans_back_as_scans(tmp_path: Path):
    album = store_of_scans(tmp_path / "a")
    with open_store(sqlite_url(tmp_path / "a")) as store:
        back_up(store, tmp_path / "b")
        for lost in (tmp_path / "b").rglob(FACTS):
            lost.unlink()  # as in a backup that was made before it was copied
        assert back_up(store, tmp_path / "b").is_whole
    restore(tmp_path / "b", locate(sqlite_url(tmp_path / "c"), {}))
    assert_scans_are_kept(tmp_path / "c", album)


def test_scans_that_are_moved_stay_scans(tmp_path: Path):
    album = store_of_scans(tmp_path / "a")
    with open_store(sqlite_url(tmp_path / "a")) as store:
        move(store, tmp_path / "c")
    assert_scans_are_kept(tmp_path / "c", album)


def test_damaged_facts_of_a_scan_are_damage(tmp_path: Path):
    store_of_scans(tmp_path)
    with open_store(sqlite_url(tmp_path)) as store:
        (sample,) = store.samples(1)
        (sample.folder / FACTS).write_text("{}")
        (found,) = verify(store).damage
        assert found.place.endswith(f"sample_00/{FACTS}")
