"""What history counts and whom lists name, at their limits."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.database import Store, open_store
from rig.errors import StoreError
from tests.support.multiviews import noisy_multiview
from tests.support.stores import new_calibration, new_sweep, sqlite_url


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path)) as opened:
        yield opened


def test_the_last_ten_are_named(store: Store):
    for _ in range(12):
        new_sweep(store)
        new_calibration(store)
    with pytest.raises(StoreError) as caught:
        store.sweep(99)
    assert caught.value.found == "asked for sweep 99, found 3, 4, 5, 6, 7, 8, 9, 10, 11, 12"
    with pytest.raises(StoreError) as caught:
        store.calibration(99)
    assert caught.value.found == "asked for calibration 99, found 3, 4, 5, 6, 7, 8, 9, 10, 11, 12"


def test_nothing_there_is_said(store: Store):
    with pytest.raises(StoreError, match="asked for calibration 1, found none yet"):
        store.calibration(1)
    with pytest.raises(StoreError, match="asked for curve 1, there is none yet"):
        store.curve(1)


def test_a_sample_outside_the_plan_tells_the_plan(store: Store):
    sweep_id = new_sweep(store)
    with pytest.raises(StoreError, match="its plan has 3 stops, from 0"):
        store.add_sample(sweep_id, stop=3, number=0, reached_mm=1.0, multiview=noisy_multiview(0))


def test_a_stop_with_more_samples_than_asked_for_is_done(store: Store):
    sweep_id = new_sweep(store, samples_per_stop=2)
    for number in range(3):
        store.add_sample(
            sweep_id, stop=0, number=number, reached_mm=400.0, multiview=noisy_multiview(number)
        )
    store.add_sample(sweep_id, stop=1, number=0, reached_mm=1.0, multiview=noisy_multiview(9))
    (row,) = store.sweeps()
    assert (row.stops_done, row.stops_planned, row.samples) == (1, 3, 4)


@pytest.mark.parametrize(
    ("row_errors", "rms_px"),
    [
        (None, None),
        ({"rms_px": [0.1, 0.75, 0.2]}, 0.75),
        ({"rms_px": []}, None),
        ({"rms_px": 0.5}, None),
        ({}, None),
    ],
)
def test_rows_are_told_by_the_view_that_misses_most(
    store: Store, row_errors: dict[str, object] | None, rms_px: float | None
):
    sweep_id = new_sweep(store)
    store.save_curve(sweep_id, curve={}, holdout={"rms_pct": 1}, versions={}, row_errors=row_errors)
    (row,) = store.sweeps()
    assert row.rows_rms_px == rms_px
    assert row.holdout_rms_pct is None  # a whole number is none that we wrote


def test_calibrations_are_listed_by_rig_oldest_first(store: Store):
    ours = [new_calibration(store, rig="ours") for _ in range(2)]
    other = new_calibration(store, rig="other")
    assert [one.id for one in store.calibrations("ours")] == ours
    assert [one.id for one in store.calibrations()] == [*ours, other]
