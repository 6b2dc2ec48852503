"""Owners and their locks: who is alive, who holds a folder, and what a strange file says."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import ConfigError, OwnedError, StoreError
from rig.file_modes import FileModes
from rig.files import make_folder
from rig.folder_lock import LOCK_FILE, FolderLock
from rig.owner import Owner, process_identity

SINCE = datetime(2026, 7, 1, 12, 30, 15, tzinfo=UTC)
OWNER = Owner("f" * 32, "bench-1", 4711, "boot 1 99", SINCE)
HOLD = """
import sys
from pathlib import Path
from rig.folder_lock import FolderLock
with FolderLock(Path(sys.argv[1])):
    print("holds", flush=True)
    sys.stdin.read()
"""


def test_an_owner_is_told_to_a_person():
    assert str(OWNER) == "process 4711 on bench-1, since 2026-07-01 12:30:15 UTC"


def test_an_owner_comes_back_from_its_file():
    assert Owner.from_json(OWNER.to_json()) == OWNER
    assert "\n" not in OWNER.to_json()


@given(st.text() | st.sampled_from(["[" * 100_000, "null", "{}", '{"pid": 1e999}']))
def test_whatever_else_is_in_the_file_names_nobody(text: str):
    assert Owner.from_json(text) is None


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)


@given(st.sampled_from(["token", "host", "pid", "since", "process"]), json_values)
def test_an_owner_with_one_strange_field_is_none_or_harmless(field: str, value: object):
    found = Owner.from_json(json.dumps({**json.loads(OWNER.to_json()), field: value}))
    assert found is None or str(found).isprintable()


def test_letters_that_move_a_terminal_are_left_out():
    found = Owner.from_json(replace(OWNER, host="a\x1b[2Jb\nc" + 300 * "d").to_json())
    assert found is not None
    assert found.host == "a[2Jbc" + 194 * "d"


def test_a_living_process_is_known_by_its_start():
    me = Owner.this_program()
    assert me.is_gone is False
    assert (me.pid, me.host) == (os.getpid(), os.uname().nodename)
    boot, space, started = me.process.split()
    assert replace(me, process=f"{boot} {space} {int(started) + 1}").is_gone is True
    assert replace(me, process=f"{boot}x {space} {started}").is_gone is None
    assert replace(me, process=f"{boot} {space}1 {started}").is_gone is None
    assert replace(me, process="").is_gone is None


def test_a_process_that_ended_and_was_not_looked_at_is_gone():
    with subprocess.Popen(["sleep", "60"]) as process:
        identity = process_identity(process.pid)
        assert identity is not None
        owner = replace(Owner.this_program(), pid=process.pid, process=identity)
        assert owner.is_gone is False
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert process_identity(process.pid) is None
        assert owner.is_gone is True
    assert owner.is_gone is True


def test_a_second_lock_is_refused_and_names_the_first(tmp_path: Path):
    with FolderLock(tmp_path, owner=OWNER) as lock:
        with pytest.raises(OwnedError) as refused:
            FolderLock(tmp_path)
        assert refused.value.found == f"asked for {tmp_path}, it belongs to {OWNER}"
        assert refused.value.advice == "let it end, or stop it there"
        assert Owner.from_json((tmp_path / LOCK_FILE).read_text()) == OWNER
        lock.require()
    assert list(tmp_path.iterdir()) == []
    FolderLock(tmp_path).release()


def test_a_lock_that_tells_nothing_still_holds(tmp_path: Path):
    with FolderLock(tmp_path):
        (tmp_path / LOCK_FILE).write_text("")
        with pytest.raises(OwnedError, match="it belongs to another program"):
            FolderLock(tmp_path)


def test_a_file_has_a_lock_of_its_own_beside_it(tmp_path: Path):
    with FolderLock.beside(tmp_path / "a.mcap"), FolderLock.beside(tmp_path / "b.mcap"):
        assert sorted(p.name for p in tmp_path.iterdir()) == [
            ".a.mcap.owner.json",
            ".b.mcap.owner.json",
        ]
        with pytest.raises(OwnedError):
            FolderLock.beside(tmp_path / "a.mcap")


def test_the_system_lets_go_of_the_lock_of_a_killed_program(tmp_path: Path):
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "holds\n"
        with pytest.raises(OwnedError, match=f"process {process.pid} on"):
            FolderLock(tmp_path)
        process.kill()
    assert (tmp_path / LOCK_FILE).exists()
    with FolderLock(tmp_path, owner=OWNER):
        assert Owner.from_json((tmp_path / LOCK_FILE).read_text()) == OWNER


def test_a_lock_whose_folder_is_gone_is_told(tmp_path: Path):
    folder = tmp_path / "frames"
    folder.mkdir()
    lock = FolderLock(folder)
    (folder / LOCK_FILE).unlink()
    with pytest.raises(StoreError, match=r"frames: the folder is gone, or another one is"):
        lock.require()
    with FolderLock(folder):
        lock.release()
        assert (folder / LOCK_FILE).exists(), "it is another program's"
    lock.release()
    folder.rmdir()
    with pytest.raises(StoreError, match="cannot take hold of the folder"):
        FolderLock(folder)


@pytest.mark.parametrize(
    ("text", "file", "folder"),
    [
        ("", 0o600, 0o700),
        ("0600", 0o600, 0o700),
        ("640", 0o640, 0o750),
        ("0o660", 0o660, 0o770),
        ("0644", 0o644, 0o755),
        ("0622", 0o622, 0o722),
        ("0666", 0o666, 0o777),
    ],
)
def test_folders_may_be_entered_by_who_may_read(text: str, file: int, folder: int):
    modes = FileModes.of({"RIG_FILE_MODE": text})
    assert (modes.file, modes.folder) == (file, folder)


@pytest.mark.parametrize(
    "text", ["0400", "0700", "0608", "rw", "-600", "02600", "0440", "٦٠٠", " "]
)
def test_other_file_modes_are_refused(text: str):
    with pytest.raises(ConfigError, match=r"RIG_FILE_MODE is .*, wanted are permission bits"):
        FileModes.of({"RIG_FILE_MODE": text})


@given(st.text())
def test_any_text_is_a_mode_or_refused(text: str):
    try:
        modes = FileModes.of({"RIG_FILE_MODE": text})
    except ConfigError:
        modes = FileModes()
    assert 0o600 <= modes.file <= 0o666
    assert modes.file & 0o600 == 0o600


def test_folders_are_made_with_their_mode_whatever_the_umask(tmp_path: Path):
    before = os.umask(0o077)
    try:
        make_folder(tmp_path / "a" / "b", 0o750)
        make_folder(tmp_path / "a" / "b", 0o700)
    finally:
        os.umask(before)
    modes = [(tmp_path / part).stat().st_mode & 0o777 for part in ("a", "a/b")]
    assert modes == [0o750, 0o750]
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(NotADirectoryError):
        make_folder(tmp_path / "file", 0o700)
