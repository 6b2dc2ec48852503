"""`rig sweep --resume` beside a sweep that runs, and before any device is open."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.database import Store, open_store
from rig.errors import OwnedError
from rig.plan import Stop
from rig.profile.load import load_profile
from rig.sweep.job import owned_to_resume, resumed_sweep
from tests.support.command import Command
from tests.support.multiviews import noisy_multiview

STOPS = (Stop(0, 400.0, "fit", "forward"), Stop(1, 500.0, "fit", "forward"))
PROFILE = load_profile("sim")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(f"sqlite:///{tmp_path}/bench/rig.sqlite") as opened:
        yield opened


@pytest.fixture
def half(store: Store) -> Path:
    """A sweep of which one program has half, and writes; returns half-written frames."""
    sweep_id = store.create_sweep(
        rig="sim",
        profile=PROFILE.model_dump(mode="json"),
        stops=STOPS,
        samples_per_stop=1,
        versions={},
        devices={},
    )
    store.add_sample(sweep_id, stop=0, number=0, reached_mm=400.0, multiview=noisy_multiview(0))
    folder = store.sweep(sweep_id).folder / "stop_001_0500.0mm_forward" / ".sample_00.0a1b.tmp"
    folder.mkdir(parents=True)
    (folder / "left.png").write_bytes(b"half")
    return folder


def contents(store: Store) -> tuple[object, ...]:
    files = {str(p): p.read_bytes() for p in store.frames.rglob("*") if p.is_file()}
    return store.sweep(1), store.samples(1), store.sweeps(), files


def test_beside_a_running_sweep_it_is_refused_before_a_device_is_opened(
    rig: Command, store: Store, half: Path, monkeypatch: pytest.MonkeyPatch
):
    def opened(*_: object) -> None:
        pytest.fail("a device was opened")

    monkeypatch.setattr("rig.hardware.opening.open_hardware", opened)
    with store.owned_sweep(1, "asked"):
        before = contents(store)
        for words in (("--resume",), ("--resume", "1")):
            answer = rig("sweep", "sim", *words)
            assert answer.code == 1
            assert answer.err.startswith("rig: asked to resume sweep 1, it belongs to process ")
            assert answer.err.count("\n") == 1
        assert "asked to fit sweep 1, it belongs to process" in rig("fit", "1").err
        assert contents(store) == before
    assert half.exists()


def test_where_a_device_does_not_open_nothing_is_changed(rig: Command, store: Store, half: Path):
    before = contents(store)
    answer = rig("sweep", "sim", "--resume", "--set", "stage.port=/dev/no-such-port")
    assert answer.code == 1
    assert "/dev/no-such-port" in answer.err
    assert contents(store) == before
    assert half.exists()
    assert store.owners() == {}


def test_a_resumed_sweep_knows_whether_a_device_is_needed(store: Store, half: Path):
    assert half.exists()
    with owned_to_resume(store, PROFILE, None) as job:
        assert (job.sweep_id, job.total, job.is_taken) == (1, 2, False)
        assert job.go_on == "rig sweep sim --resume 1"
        with (
            open_store(store.database) as other,
            pytest.raises(OwnedError),
            owned_to_resume(other, PROFILE, 1),
        ):
            pytest.fail("two owners")
        store.add_sample(1, stop=1, number=0, reached_mm=500.0, multiview=noisy_multiview(1))
    assert resumed_sweep(store, PROFILE, 1).is_taken
    assert half.exists(), "only who has its devices open changes anything"
