"""`rig store prune`: whose images go, and what is said of them afterwards."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rig.database import Store, open_store
from rig.errors import OwnedError, StoreError
from rig.store.prune import PruneRequest, prunable, prune
from rig.store.usage import usage
from rig.store.verify import verify
from tests.support.kept_stores import CONCLUDED, FILES, SAMPLES, kept_store, sample_place
from tests.support.multiviews import noisy_multiview
from tests.support.stores import new_sweep, sqlite_url

ALL = PruneRequest()


def bench(folder: Path) -> Store:
    """Return a store with a sweep of every end: passed, taken, missed, failed, failed at work."""
    store = kept_store(folder)
    for sweep_id, rig in ((3, "desk"), (4, "bench"), (5, "bench")):
        assert new_sweep(store, rig=rig, samples_per_stop=1) == sweep_id
        picture = noisy_multiview(sweep_id)
        stops = range(SAMPLES) if sweep_id == 3 else range(1)
        for stop in stops:
            store.add_sample(sweep_id, stop=stop, number=0, reached_mm=1.0, multiview=picture)
    store.save_curve(3, curve={}, holdout={}, versions={}, active=False)
    store.stop_sweep(4, failed=True)
    return store


def numbers(store: Store, request: PruneRequest) -> list[int]:
    return [sweep.sweep_id for sweep in prunable(store, request)]


def test_only_sweeps_that_ended_lose_images(tmp_path: Path):
    with bench(tmp_path) as store:
        assert numbers(store, ALL) == [CONCLUDED, 3, 4]
        assert numbers(store, PruneRequest(rig="desk")) == [3]
        assert numbers(store, PruneRequest(verdict="passed")) == [CONCLUDED]
        assert numbers(store, PruneRequest(verdict="missed")) == [3]
        assert numbers(store, PruneRequest(verdict="failed")) == [4]
        assert numbers(store, PruneRequest(rig="desk", verdict="failed")) == []
        now = datetime.now(UTC)
        assert numbers(store, PruneRequest(before=now + timedelta(hours=1))) == [CONCLUDED, 3, 4]
        assert numbers(store, PruneRequest(before=now - timedelta(hours=1))) == []
        sizes = [sweep.bytes for sweep in prunable(store, ALL)]
        images = store.sweep(CONCLUDED).folder.rglob("*.png")
        assert sizes[0] == sum(path.stat().st_size for path in images)
        assert [sweep.samples for sweep in prunable(store, ALL)] == [SAMPLES, SAMPLES, 1]


def test_images_go_and_numbers_stay(tmp_path: Path):
    with bench(tmp_path) as store:
        curve = store.curve(1)
        done = prune(store, prunable(store, PruneRequest(verdict="passed")))
        assert ([s.sweep_id for s in done.sweeps], done.refused) == ([CONCLUDED], ())
        assert list(store.sweep(CONCLUDED).folder.rglob("*.png")) == []
        assert (store.curve(1), len(store.samples(CONCLUDED))) == (curve, SAMPLES)
        found = verify(store)
        assert (found.findings, found.pruned) == ((), SAMPLES)
        row = store.history(store.frames).sweeps[0]
        assert (row.pruned, row.missing) == (SAMPLES, 0)
        assert numbers(store, PruneRequest(verdict="passed")) == []
        today = datetime.now(UTC)
        with pytest.raises(StoreError, match=rf"they were pruned on {today:%Y-%m}"):
            store.load(store.samples(CONCLUDED)[0])


@pytest.mark.slow
def test_what_was_pruned_is_not_gone_on_with(tmp_path: Path):
    with bench(tmp_path) as store:
        prune(store, prunable(store, PruneRequest(verdict="failed")))
        with pytest.raises(StoreError, match="the frames of 1 of its samples were pruned"):
            store.reopen_sweep(4)
        assert store.sweep(4).state == "failed"


def test_a_sweep_at_work_keeps_its_images(tmp_path: Path):
    with bench(tmp_path) as store, open_store(sqlite_url(tmp_path)) as other:
        wanted = prunable(store, ALL)
        with other.owned_sweep(CONCLUDED, "asked to fit"):
            assert numbers(store, ALL) == [3, 4]
            done = prune(store, wanted)
        assert [sweep.sweep_id for sweep in done.sweeps] == [3, 4]
        (line,) = done.refused
        assert line.startswith("asked to prune sweep 1, it belongs to process")
        assert sample_place(store, CONCLUDED).is_dir()


@pytest.mark.slow
def test_two_do_not_prune_at_once(tmp_path: Path):
    with bench(tmp_path) as store, open_store(sqlite_url(tmp_path)) as other:
        with (
            other.owned("frames", other.frames, "asked to make a backup"),
            pytest.raises(OwnedError, match="asked to prune"),
        ):
            prune(store, prunable(store, ALL))
        assert verify(store).pruned == 0


def test_everything_that_takes_room_is_weighed(tmp_path: Path):
    with bench(tmp_path) as store:
        (tmp_path / "captures" / "x").mkdir(parents=True)
        (tmp_path / "captures" / "x" / "y.pfm").write_bytes(bytes(1000))
        (store.frames / ".orphans").mkdir()
        (store.frames / ".orphans" / "z.png").write_bytes(bytes(70))
        (store.frames / "desk" / "calibration_1").mkdir()
        (store.frames / "desk" / "calibration_1" / "z.png").write_bytes(bytes(50))
        (store.frames / "desk" / "notes").write_bytes(bytes(9))
        found = usage(store)
        by_rig = {rig.rig: rig for rig in found.rigs}
        assert (by_rig["bench"].sweeps, by_rig["desk"].sweeps) == (4, 1)
        desk = by_rig["desk"]
        assert (desk.albums, desk.albums_bytes, desk.other_bytes) == (1, 50, 9)
        images = list((store.frames / "bench").rglob("*.png"))
        assert by_rig["bench"].sweeps_bytes == sum(p.stat().st_size for p in images)
        assert len(images) == 2 * FILES + 6
        assert (found.orphans_bytes, found.beside_bytes) == (70, {"captures": 1000})
        assert found.database_bytes is not None
        parts = sum(r.sweeps_bytes + r.albums_bytes + r.other_bytes for r in found.rigs)
        assert found.total_bytes == found.database_bytes + parts + 1070
