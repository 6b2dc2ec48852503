"""Verbs that only read: a database that is not there is named, and none is made."""

from pathlib import Path

import pytest

from rig.database import open_store
from rig.errors import StoreError
from tests.support.command import Command

READING = (
    ("history",),
    ("fit", 1),
    ("report", 1),
    ("export", 1, "--format", "ros"),
    ("export", 1, "--format", "csv"),
    ("capture", "sim", "--frames", 1),
    ("compare", "sim"),
    ("sweep", "sim", "--resume"),
)


def folder_of(tmp_path: Path) -> list[Path]:
    return sorted(tmp_path.rglob("*"))


@pytest.mark.parametrize("arguments", READING, ids=lambda arguments: "-".join(map(str, arguments)))
def test_a_mistyped_database_is_named_and_nothing_is_made(
    rig: Command, tmp_path: Path, arguments: tuple[str | int, ...]
):
    answer = rig(*arguments, "--db", f"sqlite:///{tmp_path}/typo.sqlite")
    assert answer.code == 1
    assert f"{tmp_path}/typo.sqlite, there is none" in answer.err
    assert len(answer.err.splitlines()) == 1
    assert folder_of(tmp_path) == []


def test_a_database_that_nobody_named_reads_as_empty(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.delenv("RIG_DATABASE")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    answer = rig("history")
    assert answer.code == 0
    assert "no sweep yet" in answer.out
    assert rig("history", "--json").json["sweeps"] == []
    assert "make one with rig sweep" in rig("capture", "sim", "--frames", 1).err
    assert folder_of(tmp_path) == []


def test_an_empty_database_is_no_error(rig: Command, tmp_path: Path):
    url = f"sqlite:///{tmp_path}/bench.sqlite"
    with open_store(url) as store:
        assert store.exists
    assert "no sweep yet" in rig("history", "--db", url).out


def test_an_absent_database_reads_as_empty_where_that_is_asked(tmp_path: Path):
    url = f"sqlite:///{tmp_path}/deep/none.sqlite"
    with open_store(url, absent="empty") as store:
        assert not store.exists
        assert store.sweeps() == ()
        assert store.frames == tmp_path / "deep" / "frames"
    with pytest.raises(StoreError, match="there is none"):
        open_store(url, absent="refused")
    assert folder_of(tmp_path) == []
