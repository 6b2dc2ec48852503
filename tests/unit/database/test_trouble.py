"""Disks that are full or read-only, databases that are locked or damaged, programs that are killed.

Each gives one line that says so, and costs nothing that was stored before.
"""

import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from rig.database import Store, open_store
from rig.errors import StoreError
from rig.measurement import Measurement
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import new_sweep, sqlite_url

NOBODY = 65534


def add(store: Store, sweep_id: int, number: int) -> None:
    store.add_sample(
        sweep_id, stop=0, number=number, reached_mm=400.0, multiview=noisy_multiview(number)
    )


def assert_whole(store: Store, sweep_id: int, samples: int) -> None:
    """Every row has its frames, pixel by pixel, and there are so many."""
    stored = store.samples(sweep_id)
    assert [sample.number for sample in stored] == list(range(samples))
    for sample in stored:
        assert same_multiview(store.load(sample), noisy_multiview(sample.number))


@contextmanager
def largest_file(size_bytes: int) -> Generator[None]:
    """Let no file of this process grow above a size: a disk that is full, without one."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextmanager
def without_privileges() -> Generator[None]:
    """Be bound by file permissions, which root is not."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """Return a folder that every user may reach; pytest's own are root's when root runs it."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    folder.chmod(0o755)
    shutil.rmtree(folder)


def test_no_room_for_an_image(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        sweep_id = new_sweep(store)
        add(store, sweep_id, 0)
        with largest_file(100), pytest.raises(StoreError, match="disk is full") as refused:
            add(store, sweep_id, 1)
        assert "sample_01: cannot write frames" in str(refused.value)
        assert "\n" not in str(refused.value)
        assert_whole(store, sweep_id, 1)
        of_stop = store.samples(sweep_id)[0].folder.parent
        assert [path.name for path in of_stop.iterdir()] == ["sample_00"], "room is given back"
        add(store, sweep_id, 1)
        assert_whole(store, sweep_id, 2)


def test_no_room_in_the_database(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        sweep_id = new_sweep(store)
        add(store, sweep_id, 0)
        log_bytes = (tmp_path / "rig.sqlite-wal").stat().st_size
        for write in (
            lambda: add(store, sweep_id, 1),
            lambda: store.save_measurements(sweep_id, {(0, 0): Measurement(slope_px=1.0)}),
            lambda: store.stop_sweep(sweep_id, failed=True),
        ):
            with largest_file(log_bytes), pytest.raises(StoreError, match=r"disk is full") as at:
                write()
            assert str(at.value).startswith(store.database)
            assert_whole(store, sweep_id, 1)
        assert store.measurements(sweep_id) == {}
        assert store.sweep(sweep_id).state == "taking"
        add(store, sweep_id, 1)
        assert_whole(store, sweep_id, 2)


FILL_A_DISK = """
import subprocess, sys
from pathlib import Path
from rig.database import open_store
from rig.errors import StoreError
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import new_sweep, sqlite_url

disk = Path(sys.argv[1])
subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", disk], check=True)
with open_store(sqlite_url(disk)) as store:
    sweep_id = new_sweep(store)
    for number in range(100):
        multiview = noisy_multiview(number, size_px=(160, 100))
        try:
            store.add_sample(sweep_id, stop=0, number=number, reached_mm=1.0, multiview=multiview)
        except StoreError as error:
            print(error)
            break
    assert number > 2
with open_store(sqlite_url(disk)) as store:
    assert len(store.samples(sweep_id)) == number
    for sample in store.samples(sweep_id):
        multiview = noisy_multiview(sample.number, size_px=(160, 100))
        assert same_multiview(store.load(sample), multiview)
"""


@pytest.mark.slow
def test_a_disk_that_is_really_full(tmp_path: Path) -> None:
    own_mounts = ["unshare", "--map-root-user", "--mount"]
    if (
        shutil.which("unshare") is None
        or subprocess.run([*own_mounts, "true"], check=False).returncode
    ):
        pytest.skip("a small disk of its own needs unshare and user namespaces")
    run = subprocess.run(
        [*own_mounts, sys.executable, "-c", FILL_A_DISK, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert "the disk is full" in run.stdout
    assert run.stdout.count("\n") == 1


def test_a_folder_that_may_only_be_read(open_folder: Path) -> None:
    url = sqlite_url(open_folder)
    with open_store(url) as store:
        new_sweep(store)
    open_folder.chmod(0o555)
    with (
        without_privileges(),
        pytest.raises(StoreError, match=r"cannot open the database: .*(only be read|be written)"),
    ):
        open_store(url)
    with without_privileges(), pytest.raises(StoreError, match="it may only be read"):
        open_store(sqlite_url(open_folder / "new"))
    assert not (open_folder / "new").exists()
    with open_store(url) as store:
        assert [row.id for row in store.sweeps()] == [1]


def test_frames_that_may_not_be_written(open_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = open_folder / "frames"
    frames.mkdir()
    frames.chmod(0o555)
    monkeypatch.setenv("RIG_FRAMES", str(frames))
    if os.geteuid() == 0:
        os.chown(open_folder, NOBODY, NOBODY)
    with without_privileges(), open_store(sqlite_url(open_folder)) as store:
        with pytest.raises(StoreError, match=r"frames/bench.*cannot begin a sweep: it may only be"):
            new_sweep(store)
        assert store.sweeps() == ()


def test_a_database_locked_by_another_program(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path) + "?timeout=0.05") as store:
        sweep_id = new_sweep(store)
        other = sqlite3.connect(tmp_path / "rig.sqlite", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match="another program holds it locked; let that one"):
            add(store, sweep_id, 0)
        assert_whole(store, sweep_id, 0)
        other.execute("ROLLBACK")
        other.close()
        add(store, sweep_id, 0)
        assert_whole(store, sweep_id, 1)


def test_a_damaged_database_is_named(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        new_sweep(store)
    file = tmp_path / "rig.sqlite"
    content = file.read_bytes()
    file.write_bytes(content[:4096] + b"\xff" * (len(content) - 4096))
    with (
        pytest.raises(StoreError, match=r"rig\.sqlite: cannot .*: the file is damaged"),
        open_store(sqlite_url(tmp_path)) as store,
    ):
        store.sweeps()


@pytest.mark.slow
@pytest.mark.parametrize(
    "samples", [3, *(pytest.param(count, marks=pytest.mark.slow) for count in (4, 5, 7, 11))]
)
def test_a_killed_program_leaves_whole_samples(tmp_path: Path, samples: int) -> None:
    url = sqlite_url(tmp_path)
    with open_store(url) as store:
        sweep_id = new_sweep(store)
    program = f"from tests.support.stores import *; add_samples_forever({url!r}, {sweep_id})"
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        reported = [int(child.stdout.readline()) for _ in range(samples)]
        child.send_signal(signal.SIGKILL)  # while it stores the next
        reported += [int(line) for line in child.stdout]

    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    connection.close()
    with open_store(url) as store:
        store.reopen_sweep(sweep_id)
        assert not list(tmp_path.rglob("*.tmp"))
        count = len(store.samples(sweep_id))
        assert count >= len(reported), "what was reported as stored is stored"
        add(store, sweep_id, count)
        assert_whole(store, sweep_id, count + 1)


@pytest.mark.parametrize("folder", ["../../outside", "/etc", "bench/../../x", ""])
def test_a_database_whose_folder_lies_outside_is_refused(tmp_path: Path, folder: str) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        sweep_id = new_sweep(store)
        add(store, sweep_id, 0)
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    connection.execute("UPDATE sweeps SET folder = ?", (folder,))
    connection.execute("UPDATE samples SET folder = ?", (folder,))
    connection.commit()
    connection.close()
    with open_store(sqlite_url(tmp_path)) as store:
        for use in (
            lambda: store.sweep(sweep_id),
            lambda: store.samples(sweep_id),
            lambda: ExitStack().enter_context(store.owned_sweep(sweep_id, "asked")),
        ):
            with pytest.raises(StoreError, match=r"names the folder .*, which is not below"):
                use()


def test_a_text_that_is_none_is_told_as_damage(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        sweep_id = new_sweep(store)
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    connection.execute("UPDATE sweeps SET rig = CAST(x'80ff' AS TEXT)")
    connection.commit()
    connection.close()
    with (
        open_store(sqlite_url(tmp_path)) as store,
        pytest.raises(StoreError, match="cannot read sweep 1: the database answers: Could"),
    ):
        store.sweep(sweep_id)
    connection = sqlite3.connect(tmp_path / "rig.sqlite")
    connection.execute("PRAGMA writable_schema = ON")
    connection.execute("UPDATE sqlite_master SET name = CAST(x'9480' AS TEXT), sql = 'CREATE'")
    connection.commit()
    connection.close()
    with pytest.raises(StoreError, match="cannot open the database: the file is damaged; bring"):
        open_store(sqlite_url(tmp_path))


def test_a_text_of_no_characters_is_told(tmp_path: Path) -> None:
    with (
        open_store(sqlite_url(tmp_path)) as store,
        pytest.raises(StoreError, match="a text holds what is no character; write names and notes"),
    ):
        new_sweep(store, rig="a\udcff")
