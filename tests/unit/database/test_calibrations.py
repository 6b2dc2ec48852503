"""Calibrations in the store: all of them stay, the newest active one is taken."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from rig.database import Store, open_store
from rig.errors import StoreError
from rig.measurement import Measurement
from tests.support.multiviews import noisy_multiview
from tests.support.stores import STOPS, new_calibration, new_sweep, sqlite_url


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path)) as opened:
        yield opened


def test_a_calibration_comes_back_whole(store: Store) -> None:
    before = datetime.now(UTC)
    calibration = store.calibration(new_calibration(store))
    assert (calibration.id, calibration.rig, calibration.active) == (1, "bench", True)
    assert calibration.geometry == {"version": 1, "scale": 0.1 + 0.2}
    assert calibration.quality == {"reprojection_rms_px": 0.034}
    assert calibration.profile == {"name": "bench"}
    assert calibration.versions == {"rig": "1.0"}
    assert calibration.devices == {"camera": {"serial": "A1"}}
    assert calibration.temperature_degc == 31.25
    assert calibration.image_size_px == (640, 400)
    assert before <= calibration.created_at <= datetime.now(UTC)


def test_the_newest_active_calibration_of_the_rig_is_taken(store: Store) -> None:
    assert store.active_calibration("bench") is None
    first = new_calibration(store)
    new_calibration(store, rig="other")
    missed = new_calibration(store, active=False)
    found = store.active_calibration("bench")
    assert found is not None
    assert found.id == first
    assert [one.id for one in store.calibrations("bench")] == [first, missed]
    assert len(store.calibrations()) == 3
    newest = new_calibration(store)
    found = store.active_calibration("bench")
    assert found == store.calibration(newest)


def test_a_missing_calibration_is_named_with_those_that_are_there(store: Store) -> None:
    with pytest.raises(StoreError, match="calibration 1, found none yet; rig calibrate"):
        store.calibration(1)
    new_calibration(store)
    with pytest.raises(StoreError, match="calibration 9, found 1"):
        store.calibration(9)


def test_slopes_of_another_calibration_replace_all_that_were_there(store: Store) -> None:
    calibration_id = new_calibration(store)
    sweep_id = store.create_sweep(
        rig="bench",
        profile={},
        stops=STOPS,
        samples_per_stop=2,
        versions={},
        devices={},
        calibration_id=calibration_id,
    )
    assert store.sweep(sweep_id).calibration_id == calibration_id
    for stop in (0, 1):
        store.add_sample(
            sweep_id, stop=stop, number=0, reached_mm=400.0, multiview=noisy_multiview(stop)
        )
    store.save_measurements(
        sweep_id, {(0, 0): Measurement(slope_px=1.0), (1, 0): Measurement(slope_px=2.0)}
    )
    with_it = store.save_curve(sweep_id, curve={}, holdout={}, versions={})
    store.replace_measurements(sweep_id, {(0, 0): Measurement(slope_px=3.0)}, calibration_id=None)
    without = store.save_curve(sweep_id, curve={}, holdout={}, versions={})
    assert [m.slope_px for m in store.measurements(sweep_id).values()] == [3.0]
    assert store.sweep(sweep_id).calibration_id is None
    assert store.curve(with_it).calibration_id == calibration_id
    assert store.curve(without).calibration_id is None


def test_an_unknown_calibration_changes_nothing(store: Store) -> None:
    sweep_id = new_sweep(store)
    store.add_sample(sweep_id, stop=0, number=0, reached_mm=400.0, multiview=noisy_multiview(0))
    store.save_measurements(sweep_id, {(0, 0): Measurement(slope_px=1.0)})
    with pytest.raises(StoreError, match="asked for calibration 5, found none yet"):
        store.replace_measurements(sweep_id, {(0, 0): Measurement(slope_px=2.0)}, calibration_id=5)
    assert store.measurements(sweep_id)[0, 0].slope_px == 1.0
