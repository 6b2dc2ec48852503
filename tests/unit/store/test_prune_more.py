"""`rig store prune --of albums --of captures`: what goes, and what is said of it afterwards."""

import json
import os
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rig.calibrate.album import Album
from rig.calibrate.pictures import Picture
from rig.database import Store, open_store
from rig.folder_lock import FolderLock
from rig.profile.load import load_profile
from rig.store.backup import back_up
from rig.store.prune import PruneRequest
from rig.store.prune_albums import prunable_albums, prune_albums
from rig.store.prune_captures import prunable_captures, prune_captures
from rig.store.repair import repair
from rig.store.verify import verify
from tests.support.command import Command
from tests.support.multiviews import noisy_multiview
from tests.support.stores import sqlite_url

ALL = PruneRequest()
NOW = datetime.now(UTC)
PICTURES = 2


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path / "bench")) as opened:
        yield opened


def album(store: Store, *, active: bool | None = True) -> Album:
    """Return an album of two pictures; of a calibration that is good, weak, or None: not there."""
    made = Album.new(store.frames, load_profile("sim"), store.modes)
    for number in range(PICTURES):
        made.keep(Picture(number, noisy_multiview(number, size_px=(16, 12))))
    if active is not None:
        made.write("calibration.json", "{}")
        store.save_calibration(
            rig="sim",
            geometry={"version": 1},
            quality={"folder": f"/elsewhere/{made.folder.name}"},
            profile={"name": "sim"},
            versions={},
            devices={},
            temperature_degc=None,
            image_size_px=(16, 12),
            active=active,
        )
    return made


def calibrations(store: Store, request: PruneRequest) -> list[int]:
    return [found.calibration_id for found in prunable_albums(store, request)]


def test_only_albums_of_stored_calibrations_lose_pictures(store: Store):
    good = album(store)
    album(store, active=False)
    album(store, active=None)
    assert calibrations(store, ALL) == [1, 2]
    assert calibrations(store, PruneRequest(verdict="passed")) == [1]
    assert calibrations(store, PruneRequest(verdict="missed")) == [2]
    assert calibrations(store, PruneRequest(verdict="failed")) == []
    assert calibrations(store, PruneRequest(rig="desk")) == []
    assert calibrations(store, PruneRequest(before=NOW - timedelta(hours=1))) == []
    assert calibrations(store, PruneRequest(before=NOW + timedelta(hours=1), rig="sim")) == [1, 2]
    first = prunable_albums(store, ALL)[0]
    images = list(good.folder.rglob("*.png"))
    assert (first.pictures, first.folder) == (PICTURES, good.folder)
    assert first.bytes == sum(path.stat().st_size for path in images)
    assert len(images) == 3 * PICTURES


def test_pictures_of_a_calibration_go_and_its_files_stay(store: Store, tmp_path: Path):
    kept = album(store)
    back_up(store, tmp_path / "before")
    done, refused = prune_albums(store, prunable_albums(store, ALL))
    assert ([one.calibration_id for one in done], refused) == ([1], ())
    names = {path.name for path in kept.folder.iterdir()}
    assert names == {"calibration.json", "pictures.jsonl", "profile.json", "pruned.json"}
    assert json.loads((kept.folder / "pruned.json").read_text())["pruned_at"] >= f"{NOW:%Y-%m-%d}"
    found = verify(store)
    assert (found.findings, found.albums, found.files) == ((), 1, 0)
    assert calibrations(store, ALL) == []
    made = back_up(store, tmp_path / "b")
    assert (made.files, made.bad) == (0, ())
    assert len(list((tmp_path / "before").rglob("picture_*/*.png"))) == 3 * PICTURES


def test_pictures_whose_removal_was_cut_short_go_with_repair(store: Store):
    kept = album(store)
    (kept.folder / "pruned.json").write_text("{}")
    found = verify(store)
    assert [(one.kind, one.place.rpartition("/")[2]) for one in found.findings] == [
        ("pruned", f"picture_{number:03d}") for number in range(PICTURES)
    ]
    assert found.damage == ()
    assert len(repair(store, found.findings).done) == PICTURES
    assert (verify(store).findings, list(kept.folder.glob("picture_*"))) == ((), [])


def test_an_album_at_work_keeps_its_pictures(store: Store, tmp_path: Path):
    kept = album(store)
    wanted = prunable_albums(store, ALL)
    with (
        open_store(sqlite_url(tmp_path / "bench")) as other,
        other.owned(kept.lease, kept.folder, "asked to look"),
    ):
        assert calibrations(store, ALL) == []
        done, (line,) = prune_albums(store, wanted)
    assert (done, len(list(kept.folder.glob("picture_*")))) == ((), PICTURES)
    assert line.startswith("asked to prune the pictures of calibration 1, it belongs to process")


def capture(store: Store, name: str, file: str = "frames.jsonl", age_days: float = 0.0) -> Path:
    folder = store.frames.parent / "captures" / name
    folder.mkdir(parents=True)
    (folder / file).write_bytes(bytes(100))
    written_s = NOW.timestamp() - 86400.0 * age_days
    os.utime(folder / file, (written_s, written_s))
    return folder


def captures(store: Store, request: PruneRequest) -> list[str]:
    return [found.folder.name for found in prunable_captures(store, request)]


def test_only_captures_are_taken_for_captures(store: Store):
    old = capture(store, "my_bench_20260101-101500", age_days=3.0)
    capture(store, "desk_20260102-101500", "recording_1.mcap")
    named = ("desk_20260102-101500-012345", "desk_20260102-101500-012345-2")  # as captures are now
    for name in named:
        capture(store, name)
    capture(store, "desk_20260103-101500", "holiday.txt")
    capture(store, "desk_20261399-101500")
    capture(store, "notes")
    (old.parent / "desk_20260104-101500").symlink_to(old)
    both = ["desk_20260102-101500", "my_bench_20260101-101500"]
    assert captures(store, ALL) == [both[0], *named, both[1]]
    assert captures(store, PruneRequest(rig="my_bench")) == both[1:]
    assert captures(store, PruneRequest(before=NOW - timedelta(days=2))) == both[1:]
    assert captures(store, PruneRequest(before=NOW - timedelta(days=4))) == []
    assert captures(store, PruneRequest(verdict="passed")) == []
    found = prunable_captures(store, PruneRequest(rig="my_bench"))[0]
    assert (found.bytes, found.rig) == (100, "my_bench")
    assert found.begun_at == datetime(2026, 1, 1, 10, 15, tzinfo=UTC)


def test_a_capture_goes_as_a_whole_unless_a_program_writes_into_it(store: Store):
    gone, kept = capture(store, "a_20260101-101500"), capture(store, "b_20260101-101500")
    cut_short = kept.parent / ".pruned_c_20260101-101500"
    cut_short.mkdir()
    other = kept.parent / ".pruned_notes"
    other.mkdir()
    with FolderLock(kept):
        done, (line,) = prune_captures(store, prunable_captures(store, ALL))
    assert ([one.folder for one in done], gone.exists(), kept.exists()) == ([gone], False, True)
    assert line.startswith(f"asked for {kept}, it belongs to process {os.getpid()} on ")
    assert (cut_short.exists(), other.exists()) == (False, True)


def test_prune_tells_every_kind_and_does_nothing_without_yes(rig: Command, tmp_path: Path):
    with open_store(sqlite_url(tmp_path / "bench")) as store:
        folder = album(store).folder
        kept = capture(store, "sim_20260101-101500")
    words = ("store", "prune", "--rig", "sim", "--of", "albums", "--of", "captures")
    told = rig(*words)
    assert told.code == 0
    assert [line for line in told.out.splitlines() if line.endswith("would go; do it with --yes")][
        1
    ] == "1 captures, 100 bytes, would go; do it with --yes"
    assert (kept.is_dir(), len(list(folder.glob("picture_*")))) == (True, PICTURES)
    done = rig(*words, "--yes", "--json").json
    assert (done["pruned"], "sweeps" in done) == (True, False)
    assert [one["calibration"] for one in done["albums"]] == [1]
    assert [one["folder"] for one in done["captures"]] == [str(kept)]
    assert (kept.exists(), list(folder.glob("picture_*"))) == (False, [])
    assert rig("store", "verify").code == 0
