"""Bad input is refused with numbers; one bad stop among good ones is found and named."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rig.curve import CurvePoint, fit_curve
from rig.curve.screening import find_bad_stops
from rig.errors import CurveError
from tests.support.curve_points import (
    distorted_px,
    exact_sweep,
    make_point,
    noisy_sweep,
    physical_px,
    wavy_px,
)


def fit_points(seed: int) -> list[CurvePoint]:
    return [replace(p, role="fit") for p in noisy_sweep(seed=seed)]


@pytest.mark.parametrize("at", [0, 1, 9, -1])
def test_a_bad_stop_is_named_and_left_out(at: int) -> None:
    points = fit_points(seed=1)
    bad = replace(points[at], slope_px=points[at].slope_px + 0.3)
    points[at] = bad
    fit = fit_curve(points, models=["physical"])
    assert [one.point for one in fit.bad_stops] == [bad]
    assert fit.bad_stops[0].miss_px == pytest.approx(0.3, abs=0.05)
    assert fit.warnings[0].startswith(f"the stop at {bad.distance_mm:.3f} mm ({bad.direction})")
    assert "measure this distance again" in fit.warnings[0]
    assert fit.best.focus_mm == pytest.approx(708.88, abs=0.3)


def test_two_bad_stops_do_not_hide_each_other() -> None:
    points = fit_points(seed=2)
    for at in (8, 9):
        points[at] = replace(points[at], slope_px=points[at].slope_px - 0.5)
    assert {p.point for p in find_bad_stops(points)} == {points[8], points[9]}


@pytest.mark.parametrize("law", [physical_px, distorted_px, wavy_px])
def test_good_stops_are_not_accused(law: Callable[[float], float]) -> None:
    for seed in range(10):
        assert find_bad_stops(noisy_sweep(law, seed=seed)) == ()
        assert find_bad_stops(exact_sweep(law)) == ()


def test_a_harmless_miss_is_not_accused() -> None:
    points = exact_sweep(hold_out=False)
    points[8] = replace(points[8], slope_px=points[8].slope_px + 1e-3)
    assert find_bad_stops(points) == ()


def test_of_two_visits_the_bad_one_is_left_out() -> None:
    points = exact_sweep(hold_out=False)
    back = replace(points[8], slope_px=points[8].slope_px + 1.0, direction="backward")
    fit = fit_curve([*points, back], models=["physical"])
    assert [one.point for one in fit.bad_stops] == [back]


def test_visits_that_contradict_each_other_are_refused() -> None:
    points = exact_sweep(hold_out=False)
    low = replace(points[8], slope_px=points[8].slope_px - 1.0)
    high = replace(points[8], slope_px=points[8].slope_px + 1.0, direction="backward")
    points[8:9] = [low, high]
    with pytest.raises(CurveError, match=r"800\.000 mm \(forward\).* 2\.0000 px apart"):
        fit_curve(points)


@pytest.mark.parametrize("count", [0, 1, 4])
def test_too_few_distances(count: int) -> None:
    points = exact_sweep(distances_mm=np.linspace(400.0, 1200.0, count), hold_out=False)
    with pytest.raises(CurveError, match=f"found {count} usable fit distances, a curve needs 5"):
        fit_curve(points)


def test_visits_of_one_distance_count_once() -> None:
    points = exact_sweep(distances_mm=np.linspace(400.0, 1200.0, 4), hold_out=False)
    with pytest.raises(CurveError, match="found 4 usable"):
        fit_curve([*points, *(replace(p, direction="backward") for p in points)])


def test_held_out_distances_do_not_count() -> None:
    points = exact_sweep(distances_mm=np.linspace(400.0, 1200.0, 5))
    with pytest.raises(CurveError, match="found 4 usable"):
        fit_curve(points)


def test_slopes_that_rise_are_refused() -> None:
    rising = [replace(p, slope_px=-p.slope_px) for p in exact_sweep()]
    with pytest.raises(CurveError, match=r"rises from -26\.\d+ px at 400\.000 mm .*direction"):
        fit_curve(rising)


def test_slopes_that_rise_on_the_way_are_refused() -> None:
    random = np.random.default_rng(0)
    slopes_px = np.array([26.0, *random.permutation(np.linspace(20.0, -10.0, 8)), -14.0])
    distances_mm = np.linspace(400.0, 1200.0, 10)
    points = [
        make_point(z, m) for z, m in zip(distances_mm.tolist(), slopes_px.tolist(), strict=True)
    ]
    with pytest.raises(CurveError, match=r"slope rises from .* repeat these stops"):
        fit_curve(points)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"distance_mm": 0.0}, r"a stop at 0\.0 mm"),
        ({"distance_mm": float("nan")}, "a stop at nan mm"),
        ({"distance_mm": float("inf")}, "a stop at inf mm"),
        ({"slope_px": float("nan")}, r"500\.000 mm \(forward\) has slope nan px"),
        ({"std_px": -0.1}, r"std -0\.1 px"),
        ({"sem_px": float("inf")}, "sem inf px"),
        ({"samples": 0}, "has 0 samples"),
    ],
)
def test_impossible_points_are_refused(change: dict[str, float], says: str) -> None:
    with pytest.raises(CurveError, match=says):
        make_point(**({"distance_mm": 500.0, "slope_px": 1.0} | change))
