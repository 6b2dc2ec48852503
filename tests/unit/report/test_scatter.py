from dataclasses import replace

import numpy as np
import pytest

from rig.plan import Stop
from rig.report.scatter import (
    deviations,
    direction_pairs,
    estimator_gaps,
    mm_per_px,
    repeatability,
)
from rig.sweep.points import StopResult
from tests.unit.report.conftest import Reported

# Closed form: m = f p (1 / Z - 1 / focus), so dZ/dm = -Z^2 / (f p).
MM_PX = 305.0 * 40.0


def moved(stop: StopResult, by_px: float) -> StopResult:
    assert stop.point is not None
    return replace(stop, point=replace(stop.point, slope_px=stop.point.slope_px + by_px))


def test_depth_per_slope_is_that_of_the_optics(good: Reported) -> None:
    for distance_mm in (450.0, 800.0, 1150.0):
        expected = -(distance_mm**2) / MM_PX
        assert mm_per_px(good.result.fit.best, distance_mm) == pytest.approx(expected, rel=2e-3)


def test_deviations_of_a_stop_sum_to_zero(good: Reported) -> None:
    sweep_id = good.result.sweep_id
    found = deviations(
        good.result.stops, good.store.samples(sweep_id), good.store.measurements(sweep_id)
    )
    assert len(found) == 3 * len(good.result.stops)
    by_stop: dict[float, float] = {}
    for one in found:
        by_stop[one.point.distance_mm] = by_stop.get(one.point.distance_mm, 0.0) + one.error_px
    assert list(by_stop.values()) == pytest.approx([0.0] * len(good.result.stops), abs=1e-12)


def test_pooled_scatter_is_the_noise_of_one_sample(good: Reported, least: Reported) -> None:
    pooled = repeatability(good.result.stops, good.result.fit.best)
    assert pooled is not None
    assert pooled.freedom == 2 * len(good.result.stops)
    assert pooled.std_px == pytest.approx(0.002, rel=0.5)
    assert repeatability(least.result.stops, least.result.fit.best) is None


def test_a_backward_pass_that_differs_shows_up_with_its_sign(good: Reported) -> None:
    curve = good.result.fit.best
    before = direction_pairs(good.result.stops, curve)
    stops = [
        moved(stop, 0.1) if stop.stop.direction == "backward" else stop
        for stop in good.result.stops
    ]
    after = direction_pairs(stops, curve)
    assert [pair.distance_mm for pair in after] == [400.0, 700.0]
    for old, new in zip(before, after, strict=True):
        assert new.difference_px - old.difference_px == pytest.approx(0.1, abs=1e-9)
        # A larger slope looks nearer.
        depth_mm = -0.1 * new.distance_mm**2 / MM_PX
        assert new.difference_mm - old.difference_mm == pytest.approx(depth_mm, rel=2e-3)


def test_unequal_read_back_positions_do_not_count_as_a_difference(good: Reported) -> None:
    curve = good.result.fit.best
    visits: list[StopResult] = []
    for stop, at_mm in ((0, 699.0), (1, 701.0)):
        template = good.result.stops[0]
        assert template.point is not None
        slope_px = float(curve.slope_px(np.array([at_mm]))[0])
        direction = "backward" if stop else "forward"
        point = replace(template.point, distance_mm=at_mm, slope_px=slope_px, direction=direction)
        planned = Stop(stop, 700.0, "fit", direction)
        visits.append(replace(template, stop=planned, point=point))
    [pair] = direction_pairs(visits, curve)
    assert pair.difference_px == pytest.approx(0.0, abs=1e-9)


def test_the_alarm_is_the_depth_error_that_the_limit_allows(good: Reported) -> None:
    curve = good.result.fit.best
    stop = good.result.stops[0]
    assert stop.point is not None
    [gap] = estimator_gaps([stop], curve, limit_pct=0.1)
    distance_mm = stop.point.distance_mm
    assert gap.limit_px == pytest.approx(0.001 * MM_PX / distance_mm, rel=2e-3)
    assert gap.alarms == ()
    off = replace(stop, dense_slope_px=stop.point.slope_px - 1.01 * gap.limit_px)
    [alarmed] = estimator_gaps([off], curve, limit_pct=0.1)
    assert alarmed.alarms == ("dense",)
    unknown = replace(stop, corner_slope_px=None, dense_slope_px=None)
    [silent] = estimator_gaps([unknown], curve, limit_pct=0.1)
    assert (silent.corner_px, silent.dense_px, silent.alarms) == (None, None, ())
    lost = replace(stop, point=None)
    assert estimator_gaps([lost], curve, limit_pct=0.1) == []
