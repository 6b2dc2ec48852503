"""The uncertainty of distances, as uncertainty of slopes: against the law of a pinhole."""

from typing import Any, cast

import numpy as np
import pytest

from rig.curve import CurvePoint, fit_curve
from rig.curve.reading import with_distance_sigma
from rig.sweep.points import StopResult, with_reading

A_PX_MM = 48_000.0
PLACES_MM = tuple(400.0 + 50.0 * i for i in range(17))


def point(distance_mm: float, sem_px: float = 0.003) -> CurvePoint:
    return CurvePoint(distance_mm, A_PX_MM / distance_mm, 0.01, sem_px, 5, "fit", "forward")


def test_a_reading_weighs_by_the_steepness_of_the_law() -> None:
    """m = a / Z, so dm/dZ = a / Z^2: 0.5 mm are 0.15 px at 400 mm and 0.0167 px at 1200 mm."""
    read = with_distance_sigma([point(z) for z in PLACES_MM], 0.5)
    for z, got in zip(PLACES_MM, read, strict=True):
        assert got.sem_px == pytest.approx(((0.5 * A_PX_MM / z**2) ** 2 + 9e-6) ** 0.5, rel=1e-9)
        assert (got.slope_px, got.std_px, got.distance_mm) == (A_PX_MM / z, 0.01, z)


def test_the_order_and_visits_of_one_distance_do_not_matter() -> None:
    places_mm = (800.0, 400.0, 800.0, 600.0)
    read = with_distance_sigma([point(z) for z in places_mm], 0.5)
    assert [p.distance_mm for p in read] == list(places_mm)
    assert read[0].sem_px == read[2].sem_px
    assert read[0].sem_px == pytest.approx(((0.5 * A_PX_MM / 800.0**2) ** 2 + 9e-6) ** 0.5)


def test_one_distance_alone_tells_no_steepness() -> None:
    assert with_distance_sigma([point(400.0)], 0.5) == (point(400.0),)
    assert with_distance_sigma([], 0.5) == ()


def test_a_curve_of_readings_knows_its_own_sigma() -> None:
    sure = fit_curve([point(z) for z in PLACES_MM]).best
    unsure = fit_curve(list(with_distance_sigma([point(z) for z in PLACES_MM], 0.5))).best
    at_mm = np.array([600.0])
    sigmas_mm = [
        float(best.depth_sigma_mm(best.slope_px(at_mm), np.zeros(1))[0]) for best in (sure, unsure)
    ]
    assert sigmas_mm[1] > 3.0 * sigmas_mm[0]


def test_stops_without_a_point_stay_as_they_are() -> None:
    def stop(distance_mm: float | None) -> StopResult:
        fields = dict.fromkeys(StopResult.__dataclass_fields__)
        return StopResult(
            **cast("Any", fields | {"point": None if distance_mm is None else point(distance_mm)})
        )

    stops = (stop(400.0), stop(None), stop(800.0))
    assert with_reading(stops, 0.0) is stops
    read = with_reading(stops, 0.5)
    assert read[1] == stops[1]
    expected = with_distance_sigma([point(400.0), point(800.0)], 0.5)
    assert (read[0].point, read[2].point) == expected
