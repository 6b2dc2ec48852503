"""`rig check --bundle`: what is in it, what is not, and where it is not put."""

import json
import os
import stat
import zipfile
from pathlib import Path

import pytest

from rig.check.bundle import require_new, write_bundle
from rig.errors import StoreError
from rig.secrets import without_people
from tests.support.command import Command
from tests.support.small_sim import as_options
from tests.support.stores import new_sweep, sqlite_url


def texts(file: Path) -> dict[str, str]:
    with zipfile.ZipFile(file) as bundle:
        assert bundle.testzip() is None
        return {name: bundle.read(name).decode() for name in bundle.namelist()}


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("postgresql://alice@host/rig", "postgresql://***@host/rig"),
        ("postgresql://alice:pa@ss@host/rig", "postgresql://***@host/rig"),
        ("http://host/x?user=alice&a=1", "http://host/x?user=***&a=1"),
        ("http://host/x?username=alice", "http://host/x?username=***"),
        ("sqlite:////home/alice/rig.sqlite", "sqlite:///~/rig.sqlite"),
        ('"/home/alice"', '"~"'),
        ("/home/alicesmith /srv/x", "/home/alicesmith /srv/x"),
        ("mail a@b.example, http://host/a@b", "mail a@b.example, http://host/a@b"),
        ("sslpassword=x", "sslpassword=***"),
    ],
)
def test_nobody_is_named_in_what_is_sent(text: str, shown: str):
    assert without_people(text, "/home/alice") == shown


def test_without_a_home_folders_stay():
    assert without_people("/home/alice", "") == "/home/alice"


def test_a_bundle_is_one_private_file_that_lists_what_is_inside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("HOME", str(tmp_path))
    file = tmp_path / "b.zip"
    inside = write_bundle(file, {"a.txt": f"{tmp_path}/x", "b.txt": "é"})
    found = texts(file)
    assert (found["a.txt"], found["b.txt"]) == ("~/x", "é")
    assert list(found) == ["README.txt", "a.txt", "b.txt"]
    assert inside == {name: len(text.encode()) for name, text in found.items()}
    assert "\na.txt: 3 bytes\nb.txt: 2 bytes\n" in found["README.txt"]
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_what_is_there_stays(tmp_path: Path):
    file = tmp_path / "b.zip"
    file.write_text("mine")
    with pytest.raises(StoreError, match="it exists already; name another file, or remove it"):
        write_bundle(file, {})
    assert file.read_text() == "mine"
    (tmp_path / "link.zip").symlink_to(tmp_path / "nowhere")
    with pytest.raises(StoreError, match="it exists already"):
        require_new(tmp_path / "link.zip")
    with pytest.raises(StoreError, match=r"there is no folder .*none; make the folder"):
        require_new(tmp_path / "none" / "b.zip")


def test_a_bundle_that_cannot_be_finished_is_not_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StoreError, match="cannot write the bundle: the disk is full"):
        write_bundle(tmp_path / "b.zip", {"a.txt": "x"})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_without_a_profile_a_bundle_tells_of_everything_that_is_stored(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    from rig.database import open_store

    monkeypatch.setenv("RIG_SOMETHING", "http://alice:secret@host")
    url = sqlite_url(tmp_path / "bench")
    with open_store(url) as store:
        number = new_sweep(store, rig="desk")
        (store.sweep(number).folder / "report.html").write_text("of postgresql://alice@host/rig")
        for _ in range(21):
            new_sweep(store)
    file = tmp_path / "b.zip"
    answer = rig("check", "--bundle", file, "--db", url, "--json")
    found = texts(file)
    assert answer.json["bundle"]["file"] == str(file)
    assert answer.json["bundle"]["inside"] == {k: len(v.encode()) for k, v in found.items()}
    history = json.loads(found["history.json"])
    assert [row["sweep"] for row in history["sweeps"]] == list(range(3, 23))
    assert {row["user"] for row in history["sweeps"]} == {"***"}
    versions = json.loads(found["versions.json"])
    assert versions["variables"]["RIG_SOMETHING"] == "http://***@host"
    assert {"python", "platform", "numpy", "threads"} <= set(versions)
    assert "broken_plugins" in json.loads(found["devices.json"])
    assert found["check.txt"] == "nothing was checked: no profile was named\n"
    assert not {"profile.json", "report.html"} & set(found)  # the newest 20 have none
    again = rig("check", "--bundle", file, "--db", url)
    assert (again.code, "it exists already" in again.err) == (1, True)


def test_neither_profile_nor_bundle_is_a_slip(rig: Command):
    answer = rig("check")
    assert answer.code == 2
    assert "name a PROFILE" in answer.err


@pytest.mark.slow
def test_a_check_that_fails_early_leaves_its_bundle(rig: Command, tmp_path: Path):
    file = tmp_path / "b.zip"
    url = sqlite_url(tmp_path / "none")
    answer = rig("check", "sim", "--bundle", file, "--db", url, "--calibration", "7")
    assert answer.code == 1
    assert f"rig: the bundle {file} is written all the same" in answer.err
    found = texts(file)
    assert found["check.txt"].startswith("rig: asked for calibration 7, found none yet")
    assert json.loads(found["profile.json"])["name"] == "sim"


@pytest.mark.slow
def test_a_bundle_beside_a_check_has_its_log_and_the_report_of_the_last_sweep(
    rig: Command, tmp_path: Path
):
    url = sqlite_url(tmp_path / "bench")
    from rig.database import open_store

    with open_store(url) as store:
        number = new_sweep(store, rig="sim")
        (store.sweep(number).folder / "report.html").write_text("of postgresql://alice@host/rig")
    file = tmp_path / "b.zip"
    answer = rig("check", "sim", *as_options(), "--no-move", "--bundle", file, "--db", url)
    assert answer.code in (0, 3)
    found = texts(file)
    assert found["report.html"] == "of postgresql://***@host/rig"
    said = [
        line for line in answer.out.splitlines() if line.startswith(("pass ", "WARN ", "FAIL "))
    ]
    logged = found["check.txt"].splitlines()
    assert [line[:20] for line in said] == [
        line[:20] for line in logged if line.startswith(("pass ", "WARN ", "FAIL "))
    ]
    assert logged[-1] in answer.out
    assert f"bundle {file}: README.txt (" in answer.out
