"""Who may read a store, what reaches the disk, and stores that may only be read."""

import os
import shutil
import sqlite3
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.calibrate.album import Album
from rig.calibrate.pictures import Picture
from rig.database import Store, open_store
from rig.errors import StoreError
from rig.profile.load import load_profile
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import new_sweep, sqlite_url
from tests.unit.database.test_schema import old_database
from tests.unit.database.test_trouble import without_privileges


@pytest.fixture
def public(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder that every user may reach, for a store that every user may read."""
    monkeypatch.setenv("RIG_FILE_MODE", "0644")
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755)
    shutil.rmtree(folder)


def add(store: Store, sweep_id: int, number: int = 0) -> None:
    store.add_sample(
        sweep_id, stop=0, number=number, reached_mm=1.0, multiview=noisy_multiview(number)
    )


def seal(folder: Path) -> None:
    """Take write permission from everything."""
    for path in [folder, *folder.rglob("*")]:
        path.chmod(path.stat().st_mode & 0o555)


def modes(folder: Path) -> dict[str, set[int]]:
    """Permission bits that are there, of files and of folders."""
    found: dict[str, set[int]] = {"file": set(), "folder": set()}
    for path in folder.rglob("*"):
        kind = "folder" if path.is_dir() else "file"
        found[kind].add(stat.S_IMODE(path.stat().st_mode))
    return found


@pytest.mark.parametrize(
    ("setting", "file", "folder"),
    [(None, 0o600, 0o700), ("0640", 0o640, 0o750), ("0666", 0o666, 0o777)],
)
def test_everything_that_is_stored_has_the_mode_that_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, setting: str | None, file: int, folder: int
):
    if setting is not None:
        monkeypatch.setenv("RIG_FILE_MODE", setting)
    before = os.umask(0o022)
    try:
        with open_store(sqlite_url(tmp_path / "new" / "store")) as store:
            sweep_id = new_sweep(store)
            album = Album.new(store.frames, load_profile("sim"), store.modes)
            with store.owned_sweep(sweep_id, "asked"):
                add(store, sweep_id)
                album.keep(Picture(0, noisy_multiview(0)))
                album.write("calibration.json", "{}")
                found = modes(tmp_path)
        names = {path.name for path in (tmp_path / "new" / "store").iterdir()}
    finally:
        os.umask(before)
    assert found == {"file": {file}, "folder": {folder}}
    assert "rig.sqlite" in names


def test_what_is_stored_reaches_the_disk_up_to_the_root_of_the_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    synced: set[str] = set()
    fsync = os.fsync

    def watched(handle: int) -> None:
        synced.add(str(Path(f"/proc/self/fd/{handle}").readlink()))
        fsync(handle)

    monkeypatch.setattr(os, "fsync", watched)
    with open_store(sqlite_url(tmp_path / "new")) as store:
        sweep_id = new_sweep(store)
        begun = set(synced)
        synced.clear()
        add(store, sweep_id)
        (sample,) = store.samples(sweep_id)
    root = tmp_path / "new"
    assert begun == {str(path) for path in (tmp_path, root, root / "frames", root / "frames/bench")}
    folder = sample.folder.parent.parent
    assert {str(folder), str(sample.folder.parent)} <= synced
    images = {path for path in synced if path.endswith(".png")}
    assert len(images) == len(sample.frames)
    assert {str(Path(path).parent) for path in images} <= synced


def test_an_album_reaches_the_disk_up_to_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    synced: set[str] = set()
    fsync = os.fsync

    def watched(handle: int) -> None:
        synced.add(str(Path(f"/proc/self/fd/{handle}").readlink()))
        fsync(handle)

    monkeypatch.setattr(os, "fsync", watched)
    album = Album.new(tmp_path / "frames", load_profile("sim"))
    beside = str(album.folder.with_name(f".{album.folder.name}.tmp"))  # what it was made as
    assert {str(tmp_path), str(album.folder.parent), beside} <= synced
    synced.clear()
    album.keep(Picture(0, noisy_multiview(0)))
    assert str(album.folder) in synced
    assert any("pictures.jsonl" in path for path in synced)


def test_a_store_that_may_only_be_read_is_read(public: Path):
    with open_store(sqlite_url(public)) as store:
        sweep_id = new_sweep(store)
        add(store, sweep_id)
        store.save_curve(sweep_id, curve={"a": 1.0}, holdout={}, versions={})
    seal(public)
    with without_privileges(), open_store(sqlite_url(public), absent="refused") as store:
        (row,) = store.sweeps()
        assert (row.id, row.samples, row.curve_id) == (sweep_id, 1, 1)
        (sample,) = store.samples(sweep_id)
        assert same_multiview(store.load(sample), noisy_multiview(0))
        assert store.active_curve("bench").curve == {"a": 1.0}
        with pytest.raises(StoreError, match="it may only be read; check permissions"):
            store.save_curve(sweep_id, curve={}, holdout={}, versions={})
        with pytest.raises(StoreError, match="it may only be read"):
            store.stop_sweep(sweep_id, failed=True)
    assert {path.name for path in public.iterdir()} == {"rig.sqlite", "frames"}


def test_while_its_owner_writes_others_read_what_is_newest(public: Path):
    with open_store(sqlite_url(public)) as writer:
        sweep_id = new_sweep(writer)
        for path in public.iterdir():
            path.chmod(0o644 if path.is_file() else 0o755)
        with without_privileges(), open_store(sqlite_url(public), absent="refused") as reader:
            assert reader.sweeps()[0].samples == 0
            os.seteuid(0)
            add(writer, sweep_id)
            assert reader.sweeps()[0].samples == 1


def test_an_old_store_that_may_only_be_read_is_upgraded_in_memory(public: Path):
    old_database(public / "rig.sqlite")
    (public / "rig.sqlite").chmod(0o444)
    before = (public / "rig.sqlite").read_bytes()
    seal(public)
    with without_privileges(), open_store(sqlite_url(public), absent="refused") as store:
        assert store.sweep(7).state == "concluded"
        assert store.sweeps()[0].curve_id == 2
        with pytest.raises(StoreError, match="it may only be read"):
            new_sweep(store)
    assert (public / "rig.sqlite").read_bytes() == before


def test_what_was_written_last_is_never_left_out_silently(public: Path):
    with open_store(sqlite_url(public)) as store:
        new_sweep(store)
        kept = {path.name: path.read_bytes() for path in public.iterdir() if path.is_file()}
    copy = public / "copy"
    copy.mkdir()
    for name, content in kept.items():
        if not name.endswith("-shm"):
            (copy / name).write_bytes(content)
    assert len(kept["rig.sqlite-wal"]) > 0
    seal(copy)
    with (
        without_privileges(),
        pytest.raises(StoreError, match=r"written last is still in rig.sqlite-wal, .*copy both"),
    ):
        open_store(sqlite_url(copy), absent="refused")


def test_who_writes_is_told_that_it_may_only_be_read(public: Path):
    open_store(sqlite_url(public)).close()
    seal(public)
    with without_privileges(), pytest.raises(StoreError, match="cannot open the database"):
        open_store(sqlite_url(public))


def test_a_strange_file_that_may_only_be_read_is_refused_as_ever(public: Path):
    connection = sqlite3.connect(public / "rig.sqlite")
    connection.execute("CREATE TABLE recipes (id INTEGER)")
    connection.close()
    (public / "no.sqlite").write_bytes(b"no database, but long enough to look like one" * 100)
    seal(public)
    with without_privileges():
        with pytest.raises(StoreError, match="tables recipes of another program"):
            open_store(sqlite_url(public), absent="refused")
        with pytest.raises(StoreError, match="the file is no SQLite database"):
            open_store(f"sqlite:///{public}/no.sqlite", absent="refused")


READ_ONLY_DISK = """
import subprocess, sys
from pathlib import Path
from rig.database import open_store
from tests.support.sweeps import SweepRecipe, stored_sweep

disk = Path(sys.argv[1])
subprocess.run(["mount", "-t", "tmpfs", "tmpfs", disk], check=True)
store, result = stored_sweep(disk, SweepRecipe())
store.close()
subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
url = f"sqlite:///{disk}/rig.sqlite"
from rig.cli import main
for words in (
    ["history"], ["report", "1", "--out", sys.argv[2] + "/page.html"],
    ["export", "1", "--format", "csv", "--out", sys.argv[2] + "/samples.csv"],
):
    sys.argv[:] = ["rig", *words, "--db", url]
    try:
        main()
    except SystemExit as ended:
        assert not ended.code, (words, ended.code)
"""


@pytest.mark.slow
def test_reading_verbs_work_on_a_disk_that_is_mounted_read_only(tmp_path: Path):
    own_mounts = ["unshare", "--map-root-user", "--mount"]
    if (
        shutil.which("unshare") is None
        or subprocess.run([*own_mounts, "true"], check=False).returncode
    ):
        pytest.skip("a disk of its own needs unshare and user namespaces")
    disk, out = tmp_path / "disk", tmp_path / "out"
    disk.mkdir()
    out.mkdir()
    run = subprocess.run(
        [*own_mounts, sys.executable, "-c", READ_ONLY_DISK, str(disk), str(out)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert "concluded" in run.stdout
    assert (out / "page.html").stat().st_size > 10_000
    assert list(out.glob("samples*"))
