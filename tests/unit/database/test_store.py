"""What goes into the store comes out of it."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.database import Store, open_store, software_versions
from rig.errors import StoreError
from rig.geometry.epipolar_error import EpipolarError
from rig.measurement import Failure, Measurement
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import STOPS, new_sweep, sqlite_url


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path)) as opened:
        yield opened


def add(store: Store, sweep_id: int, stop: int, number: int, seed: int = 0) -> None:
    store.add_sample(
        sweep_id, stop=stop, number=number, reached_mm=400.1, multiview=noisy_multiview(seed)
    )


def test_a_sweep_comes_back_whole(store: Store) -> None:
    before = datetime.now(UTC)
    sweep_id = store.create_sweep(
        rig="bench",
        profile={"pitch_mm": 0.1 + 0.2, "views": [{"name": "centré", "x_steps": -0.0}]},
        stops=STOPS,
        samples_per_stop=2,
        versions=software_versions(),
        devices={"camera": {"serial": "A1", "kind": "oak"}},
        note="after the lens was\nchanged",
    )
    sweep = store.sweep(sweep_id)
    assert sweep.profile == {"pitch_mm": 0.1 + 0.2, "views": [{"name": "centré", "x_steps": -0.0}]}
    assert sweep.stops == STOPS
    assert sweep.devices == {"camera": {"serial": "A1", "kind": "oak"}}
    assert {"python", "numpy", "epirig"} <= set(sweep.versions)
    assert (sweep.rig, sweep.state, sweep.ended_at) == ("bench", "taking", None)
    assert sweep.note == "after the lens was\nchanged"
    assert sweep.started_at.tzinfo is not None
    assert before <= sweep.started_at <= datetime.now(UTC)
    assert sweep.folder.is_dir()


def test_a_sample_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    with open_store(sqlite_url(tmp_path)) as store:
        sweep_id = new_sweep(store)
        taken = [(2, 1), (0, 0), (2, 0)]
        for seed, (stop, number) in enumerate(taken):
            store.add_sample(
                sweep_id,
                stop=stop,
                number=number,
                reached_mm=400.0 + 1.0 / 3.0,
                multiview=noisy_multiview(seed),
            )
    with open_store(sqlite_url(tmp_path)) as store:
        samples = store.samples(sweep_id)
        assert [sample.key for sample in samples] == [(0, 0), (2, 0), (2, 1)]
        for sample in samples:
            multiview = noisy_multiview(taken.index(sample.key))
            assert same_multiview(store.load(sample), multiview)
            assert sample.reached_mm == 400.0 + 1.0 / 3.0
            assert sample.stop == STOPS[sample.stop.index]
            assert sample.skew_s == multiview.skew_s
            assert sample.temperature_degc == multiview.temperature_degc


def test_the_stored_sample_is_the_one_read_later(store: Store) -> None:
    sweep_id = new_sweep(store)
    stored = store.add_sample(
        sweep_id, stop=1, number=0, reached_mm=1234.5, multiview=noisy_multiview(3)
    )
    assert store.samples(sweep_id) == (stored,)


def test_a_sample_is_stored_once(store: Store) -> None:
    sweep_id = new_sweep(store)
    add(store, sweep_id, 0, 0, seed=1)
    with pytest.raises(StoreError, match=r"sample 0 of stop 0 of sweep 1: it is stored already"):
        add(store, sweep_id, 0, 0, seed=2)
    assert same_multiview(store.load(store.samples(sweep_id)[0]), noisy_multiview(1))


def test_a_stop_outside_the_plan_is_refused(store: Store) -> None:
    sweep_id = new_sweep(store)
    with pytest.raises(StoreError, match="stop 3 of sweep 1, its plan has 3 stops"):
        add(store, sweep_id, 3, 0)
    assert store.samples(sweep_id) == ()
    assert list(store.sweep(sweep_id).folder.iterdir()) == []


def test_of_several_writers_of_one_sample_one_wins(store: Store) -> None:
    sweep_id = new_sweep(store)
    writers = 4
    start = threading.Barrier(writers)
    winners: list[int] = []
    losers: list[str] = []

    def write(seed: int) -> None:
        start.wait()
        try:
            add(store, sweep_id, 0, 0, seed=seed)
        except StoreError as error:
            losers.append(str(error))
        else:
            winners.append(seed)

    threads = [threading.Thread(target=write, args=(seed,)) for seed in range(writers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(winners) == 1, losers
    assert len(losers) == writers - 1
    (sample,) = store.samples(sweep_id)
    assert same_multiview(store.load(sample), noisy_multiview(winners[0]))
    assert list(sample.folder.parent.iterdir()) == [sample.folder]


def test_samples_and_slopes_are_stored_from_two_threads(store: Store) -> None:
    sweep_id = new_sweep(store, samples_per_stop=6)
    taken = threading.Semaphore(0)
    failed: list[BaseException] = []

    def measure() -> None:
        try:
            for number in range(6):
                taken.acquire()
                sample = store.samples(sweep_id)[number]
                pixels = float(np.mean(store.load(sample).images))
                store.save_measurements(sweep_id, {sample.key: Measurement(slope_px=pixels)})
        except BaseException as error:
            failed.append(error)
            raise

    worker = threading.Thread(target=measure)
    worker.start()
    for number in range(6):
        add(store, sweep_id, 0, number, seed=number)
        taken.release()
    worker.join()
    assert not failed
    assert {key: m.slope_px for key, m in store.measurements(sweep_id).items()} == {
        (0, number): float(np.mean(noisy_multiview(number).images)) for number in range(6)
    }


finite = st.floats(allow_nan=False, allow_infinity=False)
maybe = st.none() | finite
points = st.lists(st.tuples(finite, finite), min_size=1).map(tuple)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path_factory.mktemp("measured"))) as opened:
        add(opened, new_sweep(opened), 0, 0)
        yield opened


@given(
    measurement=st.builds(
        Measurement,
        slope_px=maybe,
        sigma_px=maybe,
        plane=st.none() | st.tuples(finite, finite, finite),
        centre_px=st.none() | st.tuples(finite, finite),
        corner_slope_px=maybe,
        dense_sigma_px=maybe,
        dense_pixel_sigma_px=maybe,
        failure=st.none() | st.builds(Failure, reason=st.just("blur"), message=st.just("too soft")),
        plane_sigma=st.none() | st.tuples(finite, finite, finite),
        corners_px=st.none() | st.lists(points, min_size=1).map(tuple),
        outline_px=st.none() | points,
        epipolar=st.none() | st.builds(EpipolarError, finite, finite, finite),
        track_residual_px=maybe,
        residual_levels=maybe,
        edge_pixels=st.none() | st.integers(0, 2**40),
        views=st.lists(st.text(alphabet="abc é\"'")).map(tuple),
    )
)
@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow])
def test_measurements_come_back_to_the_last_digit(
    measured: Store, measurement: Measurement
) -> None:
    measured.save_measurements(1, {(0, 0): measurement})
    assert measured.measurements(1) == {(0, 0): measurement}


def test_a_new_measurement_replaces_the_whole_old_one(store: Store) -> None:
    sweep_id = new_sweep(store)
    add(store, sweep_id, 0, 0)
    add(store, sweep_id, 2, 0)
    kept = Measurement(slope_px=-7.25, sigma_px=0.003)
    store.save_measurements(
        sweep_id, {(0, 0): Measurement(slope_px=5.0, edge_pixels=9), (2, 0): kept}
    )
    failed = Measurement(failure=Failure("glare", "board over-exposed in view left"))
    store.save_measurements(sweep_id, {(0, 0): failed})
    assert store.measurements(sweep_id) == {(0, 0): failed, (2, 0): kept}


def test_measurements_of_a_missing_sample_change_nothing(store: Store) -> None:
    sweep_id = new_sweep(store)
    add(store, sweep_id, 0, 0)
    with pytest.raises(StoreError, match="sample 1 of stop 0 of sweep 1, it is not stored"):
        store.save_measurements(
            sweep_id, {(0, 0): Measurement(slope_px=1.0), (0, 1): Measurement(slope_px=2.0)}
        )
    assert store.measurements(sweep_id) == {}


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_unknown_numbers_are_none_not_nan(number: float) -> None:
    with pytest.raises(ValueError, match="slope_px"):
        Measurement(slope_px=number)
    with pytest.raises(ValueError, match="plane"):
        replace(Measurement(), plane=(0.0, number, 0.0))
    with pytest.raises(ValueError, match="corners_px"):
        Measurement(corners_px=(((0.0, 0.0), (number, 0.0)),))
    with pytest.raises(ValueError, match="epipolar"):
        Measurement(epipolar=EpipolarError(0.0, number, 0.0))


def test_the_newest_active_curve_of_the_rig_is_taken(store: Store) -> None:
    ours, other = new_sweep(store, rig="ours"), new_sweep(store, rig="other")
    curve = {"model": "inverse", "params": [0.1 + 0.2, 1e-300], "valid_mm": [400.0, 1200.0]}
    wanted = store.save_curve(
        ours, curve=curve, holdout={"rms_pct": 0.04}, versions={"numpy": "2.4"}
    )
    store.save_curve(ours, curve={}, holdout={}, versions={}, active=False)
    store.save_curve(other, curve={}, holdout={}, versions={})
    found = store.active_curve("ours")
    assert found == store.curve(wanted)
    assert (found.id, found.rig, found.sweep_id, found.active) == (wanted, "ours", ours, True)
    assert found.curve == curve
    assert (found.holdout, found.versions) == ({"rms_pct": 0.04}, {"numpy": "2.4"})
    newer = store.save_curve(ours, curve=curve, holdout={}, versions={})
    assert store.active_curve("ours").id == newer


def test_a_curve_that_missed_a_gate_is_taken_on_purpose_only(store: Store) -> None:
    sweep_id = new_sweep(store, rig="ours")
    curve_id = store.save_curve(sweep_id, curve={}, holdout={}, versions={}, active=False)
    with pytest.raises(StoreError, match=f"its newest, {curve_id}, missed a quality gate"):
        store.active_curve("ours")


def test_a_curve_with_a_number_that_is_none_is_refused(store: Store) -> None:
    sweep_id = new_sweep(store)
    with pytest.raises(StoreError, match=r"cannot store a curve of sweep 1: .*not JSON compliant"):
        store.save_curve(sweep_id, curve={"a": float("nan")}, holdout={}, versions={})


def test_what_is_not_there_is_named_with_what_is(store: Store) -> None:
    with pytest.raises(StoreError, match="asked for sweep 1, there is none yet"):
        store.sweep(1)
    with pytest.raises(StoreError, match="curve of rig sim, found curves of no rig"):
        store.active_curve("sim")
    sweep_id = new_sweep(store, rig="left-bench")
    new_sweep(store)
    store.save_curve(sweep_id, curve={}, holdout={}, versions={})
    for ask in (store.sweep, store.samples, store.measurements, store.reopen_sweep):
        with pytest.raises(StoreError, match="asked for sweep 9, found 1, 2"):
            ask(9)
    with pytest.raises(StoreError, match="asked for sweep 9, found 1, 2"):
        store.stop_sweep(9, failed=True)
    with pytest.raises(StoreError, match="asked for curve 4, found 1"):
        store.curve(4)
    with pytest.raises(StoreError, match="curve of rig sim, found curves of left-bench"):
        store.active_curve("sim")


def test_only_a_newest_sweep_without_a_curve_is_resumed(store: Store) -> None:
    with pytest.raises(StoreError, match="rig bench, there is none"):
        store.last_resumable_sweep("bench")
    killed, stopped = new_sweep(store), new_sweep(store, samples_per_stop=1)
    other = new_sweep(store, rig="other")
    assert store.last_resumable_sweep("bench").id == stopped
    store.stop_sweep(stopped, failed=False)
    assert store.last_resumable_sweep("bench").state == "taking"
    assert store.sweep(stopped).ended_at is not None
    store.stop_sweep(stopped, failed=True)
    assert store.last_resumable_sweep("bench").state == "failed"
    reopened = store.reopen_sweep(stopped)
    assert (reopened.state, reopened.ended_at) == ("taking", None)
    for stop in range(len(STOPS)):
        assert store.sweep(stopped).state == "taking"
        add(store, stopped, stop, 0)
    taken = store.sweep(stopped)
    assert (taken.state, taken.ended_at) == ("taken", store.samples(stopped)[-1].taken_at)
    assert store.last_resumable_sweep("bench").id == stopped
    store.save_curve(stopped, curve={}, holdout={}, versions={})
    assert store.sweep(stopped).state == "concluded"
    with pytest.raises(StoreError, match=f"the newest, {stopped}, is concluded"):
        store.last_resumable_sweep("bench")
    with pytest.raises(StoreError, match=f"resume sweep {stopped}, it is concluded"):
        store.reopen_sweep(stopped)
    store.stop_sweep(stopped, failed=True)
    assert store.sweep(stopped).state == "concluded"
    assert store.reopen_sweep(killed).state == "taking"
    assert store.sweep(other).state == "taking"


def test_a_curve_of_half_a_sweep_leaves_the_rest_to_be_taken(store: Store) -> None:
    sweep_id = new_sweep(store, samples_per_stop=1)
    add(store, sweep_id, 0, 0)
    add(store, sweep_id, 0, 1)  # more of one stop are not those of another
    add(store, sweep_id, 0, 2)
    store.save_curve(sweep_id, curve={}, holdout={}, versions={})
    assert store.sweep(sweep_id).state == "taking"
    assert store.reopen_sweep(sweep_id).state == "taking"


def test_a_failed_sweep_with_all_samples_has_only_its_curve_to_come(store: Store) -> None:
    sweep_id = new_sweep(store, samples_per_stop=1)
    for stop in range(len(STOPS)):
        add(store, sweep_id, stop, 0)
    store.stop_sweep(sweep_id, failed=True)
    assert store.sweep(sweep_id).state == "failed"
    reopened = store.reopen_sweep(sweep_id)
    assert (reopened.state, reopened.ended_at is None) == ("taken", False)
    store.stop_sweep(sweep_id, failed=False)
    assert store.sweep(sweep_id).state == "taken"


def test_history_tells_how_far_every_sweep_came(store: Store) -> None:
    assert store.sweeps() == ()
    first, second = new_sweep(store, samples_per_stop=2), new_sweep(store, rig="other")
    for stop, number in [(0, 0), (0, 1), (1, 0)]:
        add(store, first, stop, number)
    store.stop_sweep(first, failed=True)
    store.save_curve(first, curve={}, holdout={"rms_pct": 0.5}, versions={})
    newest = store.save_curve(first, curve={}, holdout={"rms_pct": 0.25}, versions={})
    done, empty = store.sweeps()
    assert (done.id, done.rig, done.state) == (first, "bench", "failed")
    assert (done.stops_done, done.stops_planned, done.samples) == (1, 3, 3)
    assert (done.curve_id, done.holdout_rms_pct) == (newest, 0.25)
    assert done.ended_at == store.sweep(first).ended_at
    assert (empty.id, empty.rig, empty.stops_done, empty.samples) == (second, "other", 0, 0)
    assert (empty.curve_id, empty.holdout_rms_pct, empty.ended_at) == (None, None, None)
