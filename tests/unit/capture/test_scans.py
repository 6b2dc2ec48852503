"""Captures with a camera that moves, and options that only such a one has."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.capture.capture import CaptureRequest
from rig.capture.on_rig import capture_on_rig
from rig.capture.scans import owned_scans, require_scan, scans_of
from rig.database import open_store
from rig.errors import OptionError, OwnedError, StoreError
from rig.profile.load import load_profile
from rig.stored import RunChoice
from tests.support.small_scan import SMALL_SCAN
from tests.support.stores import sqlite_url

ONE = CaptureRequest(frames=1, duration_s=None, folder=None)
SLOPES = ("camera.row.at_mm=[-20.0, 0.0, 12.5]", "quality.valid_share_pct=0.0")


@pytest.mark.slow
def test_one_light_field_is_captured_and_given_again(tmp_path: Path):
    rig = load_profile("sim-scan", (*SMALL_SCAN, *SLOPES))
    choice = RunChoice(sqlite_url(tmp_path), calibration="none", curve="none")
    for resume in (False, True):
        request = replace(ONE, folder=tmp_path / f"out{resume:d}", resume=resume)
        summary = capture_on_rig(rig, choice, request, lambda *_: None, lambda _: None)
        assert summary.frames == 1
        assert summary.skew_s.largest == 0.0
        assert summary.valid_pct > 20.0
        assert summary.picture is not None
    (scan,) = (tmp_path / "scans" / "sim-scan").iterdir()
    assert len(list(scan.glob("take_*.png"))) == 5


def test_a_scan_without_an_end_is_told():
    with pytest.raises(OptionError, match="its camera moves for every light field"):
        require_scan(load_profile("sim-scan"), replace(ONE, frames=None))


def test_a_camera_that_stands_has_nothing_to_resume():
    with pytest.raises(OptionError, match="stands still"):
        require_scan(load_profile("sim"), replace(ONE, resume=True))
    require_scan(load_profile("sim"), replace(ONE, frames=None))
    require_scan(load_profile("sim-scan"), replace(ONE, resume=True))
    with pytest.raises(OptionError, match="--frames 1"):
        require_scan(load_profile("sim-scan"), replace(ONE, frames=None, resume=True))


def test_takes_are_kept_beside_the_frames(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store:
        found = scans_of(store, load_profile("sim-scan"), replace(ONE, resume=True))
        assert found is not None
        assert found.folder == store.frames.parent / "scans" / "sim-scan"
        assert found.resume
        assert found.file_mode == store.modes.file
        assert scans_of(store, load_profile("sim"), ONE) is None


def test_one_program_at_a_time_scans_with_a_rig(tmp_path: Path):
    rig = load_profile("sim-scan", (*SMALL_SCAN, *SLOPES))
    choice = RunChoice(sqlite_url(tmp_path), calibration="none", curve="none")
    with open_store(sqlite_url(tmp_path)) as store:
        scans = scans_of(store, rig, ONE)
        with (
            owned_scans(store, rig.name, scans),
            pytest.raises(OwnedError, match=r"asked to scan with sim-scan, it belongs to process"),
        ):
            capture_on_rig(rig, choice, ONE, lambda *_: None, lambda _: None)
        assert store.owners() == {}
        with owned_scans(store, rig.name, scans):
            assert set(store.owners()) == {"scan sim-scan"}
        with owned_scans(store, "sim", None):
            assert store.owners() == {}


def test_a_folder_of_takes_that_cannot_be_made_is_told(tmp_path: Path):
    (tmp_path / "scans").write_text("a file")
    with open_store(sqlite_url(tmp_path)) as store:
        scans = scans_of(store, load_profile("sim-scan"), ONE)
        with (
            pytest.raises(StoreError, match=r"takes of a scan cannot be kept there: .*directory"),
            owned_scans(store, "sim-scan", scans),
        ):
            raise AssertionError
