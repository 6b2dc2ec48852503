"""A camera on a slider, killed and interrupted wherever it hurts: no view is lost."""

import json
import signal
from pathlib import Path

import pytest

from rig.database import open_store
from tests.support.signalled import STILL, run_signalled
from tests.support.small_scan import SMALL_SCAN, SWEPT_SCAN
from tests.support.small_sim import as_options
from tests.support.stores import sqlite_url

pytestmark = pytest.mark.slow

KEEP = "call:rig_drivers.scan.on_disk:OnDisk.keep"
PUT = "call:rig.files:sync_folder"
MOVE = "call:rig_sim.carriage:Carriage.follow"
SECOND_SCAN = "call:rig_drivers.scan.kept:InMemory.keep:8"
"""Five takes are a scan: of three views, and of the reference before and after them."""
ROW = ("camera.row.at_mm=[-20.0, 0.0, 12.5]", "quality.valid_share_pct=0.0")


def capture(number: int, point: str, folder: Path, *more: str):
    words = ("capture", "sim-scan", *as_options((*SMALL_SCAN, *ROW)), "--frames", "1", *more)
    where = ("--slopes-only", "--calibration", "none", "--db", sqlite_url(folder), "--json")
    return run_signalled(number, point, *words, *where)


ALL_FITTED = ("sweep.holdout_every=0", "sweep.backward_every=0")


def sweep(number: int, point: str, folder: Path, *more: str):
    words = [
        "sweep",
        "sim-scan",
        *more,
        *as_options((*SWEPT_SCAN, *ALL_FITTED)),
        "--db",
        sqlite_url(folder),
    ]
    return run_signalled(number, point, *words)


def test_a_sweep_killed_between_two_views_of_a_scan_says_that_it_is_taken_anew(tmp_path: Path):
    stops = ("--at-mm", "400,500,650,800,900", "--samples", "1", "--calibration", "none")
    begun = sweep(signal.SIGKILL, SECOND_SCAN, tmp_path, *stops)
    assert begun.code == -signal.SIGKILL
    with open_store(sqlite_url(tmp_path)) as store:
        (first,) = store.samples(1)
        before = {file: file.read_bytes() for file in first.folder.iterdir()}
    again = sweep(signal.SIGKILL, f"{MOVE}:100000", tmp_path, "--resume")
    assert again.code in (0, 3), again.err
    assert "1 of 5 scans are whole and kept; one that was cut off" in again.err
    with open_store(sqlite_url(tmp_path)) as store:
        assert len(store.samples(1)) == 5
        assert {file: file.read_bytes() for file in first.folder.iterdir()} == before


def takes(folder: Path) -> dict[str, bytes]:
    """Every take that counts, by the name of its file."""
    lines = sorted((folder / "scans").glob("*/*/take_*.json"))
    pictures = [line.with_suffix(".png") for line in lines]
    return {file.name: file.read_bytes() for file in (*lines, *pictures)}


def test_killed_at_every_take_and_between_nothing_is_lost(tmp_path: Path):
    points = [f"{KEEP}:{n}" for n in (2, 1, 2)] + [f"{PUT}:{n}" for n in (3, 2)] + [f"{MOVE}:9"]
    before: dict[str, bytes] = {}
    for count, point in enumerate(points):
        ended = capture(signal.SIGKILL, point, tmp_path, *(["--resume"] if count else []))
        assert ended.code == -signal.SIGKILL, ended.err
        after = takes(tmp_path)
        assert {name: after.get(name) for name in before} == before
        before = after
    ended = capture(signal.SIGKILL, f"{MOVE}:100000", tmp_path, "--resume")
    assert ended.code == 0, ended.err
    assert json.loads(ended.out[: ended.out.rindex("}") + 1])["frames"] == 1
    assert STILL in ended.out
    after = takes(tmp_path)
    assert {name: after[name] for name in before} == before
    views = [json.loads(text)["view"] for name, text in after.items() if name.endswith("json")]
    assert set(views) == {"reference", "h0", "h2"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_the_slider_standing_and_the_views_kept(number: int, tmp_path: Path):
    ended = capture(number, f"{KEEP}:3", tmp_path)
    assert ended.code == 130
    assert "Traceback" not in ended.err
    assert STILL in ended.out
    assert len(takes(tmp_path)) in (4, 6)
