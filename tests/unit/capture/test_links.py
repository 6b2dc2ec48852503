"""Symbolic links in output folders lead nowhere."""

from pathlib import Path

import pytest

from rig.errors import StoreError
from rig.files import no_link, write_bytes
from rig.folder_lock import LOCK_FILE, FolderLock


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    path = tmp_path / "outside"
    path.write_bytes(b"precious")
    return path


def test_a_link_in_place_of_a_lock_is_refused(tmp_path: Path, outside: Path):
    (tmp_path / LOCK_FILE).symlink_to(outside)
    with pytest.raises(StoreError, match="a symbolic link is at its place; remove the link"):
        FolderLock(tmp_path)
    assert outside.read_bytes() == b"precious"


def test_a_link_in_place_of_a_map_gives_way(tmp_path: Path, outside: Path):
    link = tmp_path / "depth_00000.pfm"
    link.symlink_to(outside)
    write_bytes(link, b"new")
    assert (link.read_bytes(), link.is_symlink()) == (b"new", False)
    assert outside.read_bytes() == b"precious"


def test_a_link_in_place_of_the_list_of_frames_is_refused(tmp_path: Path, outside: Path):
    link = tmp_path / "frames.jsonl"
    link.symlink_to(outside)
    with pytest.raises(OSError, match="symbolic links"):
        open(link, "w", opener=no_link)  # noqa: SIM115
    assert outside.read_bytes() == b"precious"
    link.unlink()
    with open(link, "w", encoding="utf-8", opener=no_link) as file:
        file.write("{}")
    assert link.read_text() == "{}"
