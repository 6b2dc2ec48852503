"""Looks since a calibration as a series: which ones, how sure, and what is drawn of them."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from rig.drift_series import MOST, drift_series
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.records import StoredCalibration, StoredDrift
from tests.support.scene_features import row_of

RIG = row_of((0.0, 0.0, 0.0), (0.0, 0.0, 90.0))
BEGAN = datetime(2026, 11, 2, 8, tzinfo=UTC)
SURE = np.diag(
    np.array([*12 * [0.01], *np.radians([0.01, 0.02, 0.03]), *3 * [0.1], *6 * [0.0]]) ** 2
)


def calibration(**changed: object) -> StoredCalibration:
    geometry = geometry_to_json(replace(RIG, covariance=SURE))
    made = StoredCalibration(
        3, "bench", BEGAN, geometry, {}, {}, {}, {}, 31.5, (640, 480), active=True
    )
    return replace(made, **changed)  # pyright: ignore[reportArgumentType]


def look(number: int, *, of: int = 3, **details: object) -> StoredDrift:
    told = {
        "turned_deg": {"right": [0.01 * number, 0.5, -0.02]},
        "sigma_deg": {"right": [0.001, 0.1, 0.002]},
        "probability": 0.25,
    }
    at = BEGAN + timedelta(seconds=30 * number)
    return StoredDrift(number, "bench", of, at, 31.5 + number, {**told, **details})


def test_only_looks_of_this_calibration_are_taken():
    series = drift_series(calibration(), [look(1), look(2, of=4), look(3)])
    assert [one.id for one in series.looks] == [1, 3]
    assert [one.id for one in series.joined(look(5)).looks] == [1, 3, 5]


def test_the_calibration_says_how_sure_it_is_of_pitch_and_roll():
    known = drift_series(calibration(), []).known_deg
    assert known["right"] == pytest.approx((0.01, 0.03))
    assert known["far"] == (0.0, 0.0)
    unsure = calibration(geometry=geometry_to_json(RIG))
    assert drift_series(unsure, []).known_deg == {}


def test_what_is_drawn_is_columns():
    drawn = drift_series(calibration(), [look(1), look(2)]).to_json()
    assert drawn["views"]["right"] == {
        "known_deg": pytest.approx((0.01, 0.03)),
        "turned_deg": [[0.01, -0.02], [0.02, -0.02]],
        "sigma_deg": [[0.001, 0.002]] * 2,
    }
    assert drawn["time_ms"] == [1e3 * (BEGAN.timestamp() + 30.0 * k) for k in (1, 2)]
    assert drawn["look_degc"] == [32.5, 33.5]
    assert (drawn["calibration"], drawn["degc"], drawn["looks"]) == (3, 31.5, 2)


def test_long_series_are_thinned_and_end_with_the_newest():
    drawn = drift_series(calibration(), [look(k) for k in range(2 * MOST + 1)]).to_json()
    assert drawn["looks"] == 2 * MOST + 1
    assert len(drawn["time_ms"]) <= MOST
    assert drawn["views"]["right"]["turned_deg"][-1][0] == pytest.approx(0.01 * 2 * MOST)


@pytest.mark.parametrize("damaged", [None, "x", {"right": 3}, {"right": [0.1]}, {"right": "abcd"}])
def test_what_a_look_does_not_tell_is_a_gap(damaged: object):
    drawn = drift_series(calibration(), [look(1), look(2, turned_deg=damaged)]).to_json()
    assert drawn["views"]["right"]["turned_deg"] == [[0.01, -0.02], None]


def test_without_looks_nothing_is_drawn():
    drawn = drift_series(calibration(), []).to_json()
    assert (drawn["looks"], drawn["views"], drawn["time_ms"]) == (0, {}, [])
