"""Held-out error and the headline are what their definitions say."""

import numpy as np
import pytest

from rig.curve import (
    Curve,
    CurveFit,
    DepthError,
    Headline,
    HoldoutError,
    Residual,
    depth_errors,
    fit_curve,
    headline,
)
from rig.curve.models import fit_physical
from rig.curve.points import stops_of
from rig.curve.residuals import residuals_of
from rig.errors import CurveError
from tests.support.curve_points import exact_sweep, make_point, noisy_sweep, physical_px


def held_out(distance_mm: float, error_mm: float) -> Residual:
    point = make_point(distance_mm, 1.0, role="holdout")
    return Residual(point, error_px=-0.1 * error_mm, error_mm=error_mm)


@pytest.fixture(scope="module")
def fit() -> CurveFit:
    return fit_curve(noisy_sweep(seed=1), models=["physical"])


def test_summary_of_known_errors() -> None:
    error = HoldoutError.of((held_out(500.0, 1.0), held_out(500.0, -2.0), held_out(1000.0, 4.0)))
    assert error.bias_pct == pytest.approx((0.2 - 0.4 + 0.4) / 3)
    assert error.rms_pct == pytest.approx(np.sqrt((0.04 + 0.16 + 0.16) / 3))
    assert error.max_pct == pytest.approx(0.4)
    assert error.rms_mm == pytest.approx(np.sqrt(7.0))
    assert error.rms_px == pytest.approx(0.1 * np.sqrt(7.0))
    assert error.distances == 2


def test_a_known_slip_of_a_held_out_stop_comes_back_in_mm() -> None:
    points = exact_sweep(hold_out=False)
    slipped = make_point(725.0, physical_px(725.5), role="holdout")
    holdout = fit_curve([*points, slipped], models=["physical"]).holdout
    assert holdout is not None
    assert holdout.residuals[0].error_mm == pytest.approx(0.5, rel=1e-3)
    assert holdout.bias_pct == pytest.approx(100 * 0.5 / 725.0, rel=1e-3)


def test_expanded_error_at_a_distance(fit: CurveFit) -> None:
    assert fit.holdout is not None
    (error,) = depth_errors(fit.best, fit.holdout, [1000.0])
    at_px = fit.best.slope_px(np.array([1000.0]))
    # Student's t for 4 held-out distances at 95.45 %.
    widened_px = fit.holdout.rms_px * 2.869 / 2
    curve_px = fit.best.curve_sigma_px(np.array([1000.0]))
    expected_mm = 2 * np.hypot(widened_px, curve_px) * -fit.best.law.depth_per_slope(at_px)
    assert fit.holdout.distances == 4
    assert error.distance_mm == 1000.0
    assert error.expanded_mm == pytest.approx(float(expected_mm[0]), rel=1e-3)


@pytest.mark.slow
def test_twice_the_error_covers_new_stops_as_often_as_k_2_promises() -> None:
    inside = []
    for seed in range(80):
        points = noisy_sweep(seed=seed, stop_px=0.01)
        curve = Curve.of(fit_physical(stops_of([p for p in points if p.role == "fit"])))
        judged = [p for p in points if p.role == "holdout"]
        holdout = HoldoutError.of(residuals_of(judged, curve.law))
        (error,) = depth_errors(curve, holdout, [925.0])
        noise_px = np.random.default_rng(1000 + seed).normal(size=50) * np.hypot(0.01, 0.0045)
        depths_mm = curve.depth_mm(physical_px(925.0) + noise_px)
        inside.append(np.mean(np.abs(depths_mm - 925.0) < error.expanded_mm))
    assert np.mean(inside) == pytest.approx(0.955, abs=0.03)


def test_headline_says_range_error_and_ground(fit: CurveFit) -> None:
    line = headline(fit.best, fit.holdout)
    assert line.valid_mm == (400.0, 1200.0)
    assert [e.distance_mm for e in line.errors] == [1000.0]
    assert str(line).startswith("valid 0.40-1.20 m, board plane +-")
    assert str(line).endswith(" mm at 1 m, k=2 (4 held-out distances)")
    two = headline(fit.best, fit.holdout, [500.0, 1200.0])
    assert [e.distance_mm for e in two.errors] == [500.0, 1200.0]
    assert two.errors[0].expanded_mm < two.errors[1].expanded_mm


def test_headline_text() -> None:
    errors = (DepthError(1000.0, 0.9), DepthError(2500.0, 12.34))
    line = Headline((400.0, 2500.0), errors, distances=1)
    assert str(line) == (
        "valid 0.40-2.50 m, board plane +-0.9 mm at 1 m, +-12 mm at 2.5 m, k=2 "
        "(1 held-out distance)"
    )


def test_headline_without_held_out_distances_promises_nothing(fit: CurveFit) -> None:
    assert str(headline(fit.best, None)) == (
        "valid 0.40-1.20 m, depth error unknown (no held-out distance)"
    )


def test_headline_of_a_short_curve_is_quoted_at_its_far_end() -> None:
    points = exact_sweep(distances_mm=np.linspace(400.0, 800.0, 9))
    fit = fit_curve(points, models=["physical"])
    assert [e.distance_mm for e in headline(fit.best, fit.holdout).errors] == [800.0]


def test_an_error_outside_the_range_is_refused(fit: CurveFit) -> None:
    assert fit.holdout is not None
    with pytest.raises(CurveError, match=r"at 2000\.0 mm, the curve is valid for 400\.0-1200\.0"):
        depth_errors(fit.best, fit.holdout, [1000.0, 2000.0])
