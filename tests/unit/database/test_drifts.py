"""What scenes told of the cameras, as a series."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from rig.database import open_store
from rig.errors import StoreError
from tests.support.stores import new_calibration, sqlite_url


def test_looks_come_back_as_they_were_oldest_first(tmp_path: Path):
    before = datetime.now(UTC)
    with open_store(sqlite_url(tmp_path)) as store:
        calibration = new_calibration(store)
        first = store.save_drift(
            calibration, rig="bench", details={"rows_px": 0.125}, temperature_degc=31.5, unit="7"
        )
        second = store.save_drift(calibration, rig="other", details={}, temperature_degc=None)
        looks, own = store.drifts(), store.drifts("bench")
        listed = store.history(store.frames).drifts
    assert [look.id for look in looks] == [first.id, second.id]
    assert looks == (first, second)
    assert listed == looks
    assert own == looks[:1]
    look = own[0]
    assert (look.rig, look.unit, look.calibration_id) == ("bench", "7", calibration)
    assert look.details == {"rows_px": 0.125}
    assert look.temperature_degc == 31.5
    assert before <= look.measured_at <= datetime.now(UTC)
    assert looks[1].temperature_degc is None


def test_a_look_at_no_calibration_is_refused(tmp_path: Path):
    with open_store(sqlite_url(tmp_path)) as store, pytest.raises(StoreError, match="drift of b"):
        store.save_drift(99, rig="bench", details={}, temperature_degc=None)
