"""The fit recovers known rigs, knows its own error, and chooses the law that the distances show."""

import re

import numpy as np
import pytest

from rig.curve import ALL_MODELS, CurveFit, CurvePoint, fit_curve
from rig.curve.models import fit_physical, fit_spline, fit_two_lines
from rig.curve.points import stops_of
from rig.errors import CurveError
from tests.support.curve_points import (
    DISTANCES_MM,
    FOCUS_MM,
    distorted_px,
    exact_sweep,
    make_point,
    noisy_sweep,
    physical_px,
    wavy_px,
)


@pytest.fixture(scope="module")
def physical_fit() -> CurveFit:
    return fit_curve(noisy_sweep(seed=1))


def test_physical_truth_is_found_physical(physical_fit: CurveFit) -> None:
    assert physical_fit.best.model == "physical"
    assert physical_fit.best.focus_mm == pytest.approx(FOCUS_MM, abs=0.3)
    assert not physical_fit.bad_stops
    assert not physical_fit.warnings


def test_every_model_shows_its_residuals(physical_fit: CurveFit) -> None:
    assert [c.curve.model for c in physical_fit.candidates] == list(ALL_MODELS)
    assert not physical_fit.rejected
    points = noisy_sweep(seed=1)
    for candidate in physical_fit.candidates:
        assert [r.point for r in candidate.residuals] == sorted(
            points, key=lambda p: (p.distance_mm, p.direction)
        )
        assert {r.point.role for r in candidate.left_out} == {"fit"}
        assert 400.0 not in {r.point.distance_mm for r in candidate.left_out}
        assert candidate.cv_rms_px > 0
        assert candidate.cv_rms_pct > 0


@pytest.mark.slow
def test_noise_alone_rarely_buys_a_curvature() -> None:
    models = ("physical", "physical-curved")
    distances_mm = np.linspace(400.0, 1200.0, 11)
    chosen = [
        fit_curve(noisy_sweep(distances_mm=distances_mm, seed=seed), models=models).best.model
        for seed in range(5)
    ]
    assert chosen.count("physical") >= 4


def test_a_distorted_rig_gets_the_curvature() -> None:
    fit = fit_curve(noisy_sweep(distorted_px, seed=2))
    assert fit.best.model == "physical-curved"
    unseen_mm = np.linspace(410.0, 1190.0, 50)
    slopes_px = np.array([distorted_px(z) for z in unseen_mm])
    assert np.abs(fit.best.depth_mm(slopes_px) / unseen_mm - 1).max() < 5e-4


@pytest.mark.slow
def test_a_wavy_rig_gets_the_spline() -> None:
    fit = fit_curve(noisy_sweep(wavy_px, np.linspace(400.0, 1200.0, 25), seed=3))
    assert fit.best.model == "spline"
    assert fit.holdout is not None
    assert fit.holdout.max_pct < 0.5


@pytest.mark.slow
def test_two_lines_are_found_where_they_are_the_truth() -> None:
    def law_px(z: float) -> float:
        return (700.0 - z) * (0.09 if z < 700.0 else 0.03)

    fit = fit_curve(noisy_sweep(law_px, seed=4))
    assert fit.best.model == "two-lines"
    assert fit.best.params == pytest.approx(
        {"focus_mm": 700.0, "before_px_per_mm": -0.09, "after_px_per_mm": -0.03}, rel=1e-3
    )


def test_order_of_points_does_not_matter() -> None:
    points = noisy_sweep(seed=5)
    shuffled = [points[i] for i in np.random.default_rng(0).permutation(len(points))]
    models = ("physical", "spline")
    assert fit_curve(points, models=models) == fit_curve(shuffled, models=models)


@pytest.mark.slow
def test_held_out_stops_enter_neither_fit_nor_choice() -> None:
    points = noisy_sweep(seed=6)
    spoiled = [
        make_point(p.distance_mm, p.slope_px + 1.0, role="holdout") if p.role == "holdout" else p
        for p in points
    ]
    models = ("physical", "physical-curved")
    clean, other = fit_curve(points, models=models), fit_curve(spoiled, models=models)
    assert clean.best == other.best
    assert clean.holdout is not None
    assert other.holdout is not None
    assert other.holdout.rms_px > 10 * clean.holdout.rms_px


@pytest.mark.slow
def test_sigma_covers_the_truth_as_often_as_it_says() -> None:
    unseen_mm = np.array([450.0, 700.0, 1150.0])
    slopes_px = np.array([physical_px(z) for z in unseen_mm])
    pulls = []
    for seed in range(120):
        points = noisy_sweep(distances_mm=DISTANCES_MM, seed=seed)
        fitted = fit_physical(stops_of(points))
        gradient = fitted.law.slope_gradient(slopes_px)
        sigma_px = np.sqrt(np.einsum("np,pq,nq->n", gradient, fitted.covariance, gradient))
        pulls.append((fitted.law.slope_px(unseen_mm) - slopes_px) / sigma_px)
    pull = np.abs(np.array(pulls))
    # 120 sweeps: a share of 0.68 is known to about 0.04.
    assert np.mean(pull < 1) == pytest.approx(0.66, abs=0.08)
    assert np.mean(pull < 2) == pytest.approx(0.94, abs=0.04)


def test_scatter_between_stops_is_estimated_beside_that_of_samples() -> None:
    scatters_px = [
        fit_physical(stops_of(noisy_sweep(seed=seed, sample_px=0.004, stop_px=0.02))).scatter_px
        for seed in range(20)
    ]
    assert np.mean(scatters_px) == pytest.approx(0.02, rel=0.15)
    none_px = fit_physical(stops_of(noisy_sweep(seed=0, sample_px=0.02, stop_px=0.0))).scatter_px
    assert none_px < 0.01


def test_a_lucky_standard_error_does_not_pull_the_curve() -> None:
    points = noisy_sweep(seed=7)
    at = next(i for i, p in enumerate(points) if p.distance_mm == 600.0 and p.role == "fit")
    lucky = make_point(600.0, points[at].slope_px + 0.02, std_px=1e-9, sem_px=1e-9)
    pulled = fit_physical(stops_of([*points[:at], lucky, *points[at + 1 :]]))
    assert abs(float(pulled.law.slope_px(np.array([600.0]))[0]) - physical_px(600.0)) < 0.006


def test_spline_joins_neighbours_that_noise_put_in_false_order() -> None:
    slopes_px = [26.0, 14.0, 14.01, -3.0, -10.0, -14.0]
    points = [
        make_point(z, m, sem_px=0.01)
        for z, m in zip([400.0, 500.0, 501.0, 800.0, 1000.0, 1200.0], slopes_px, strict=True)
    ]
    law = fit_spline(stops_of(points)).law
    assert law.knots_mm == pytest.approx((400.0, 500.5, 800.0, 1000.0, 1200.0))
    assert law.knots_px[1] == pytest.approx(14.005)


def test_models_that_cannot_be_fitted_say_why() -> None:
    fit = fit_curve(exact_sweep(distances_mm=np.linspace(400.0, 650.0, 9)))
    reasons = {one.model: one.reason for one in fit.rejected}
    assert reasons["two-lines"] == (
        "0 distances after the focus distance; a line on either side needs 2"
    )
    with pytest.raises(CurveError, match=r"^1 distance after the focus distance"):
        fit_two_lines(stops_of(exact_sweep(distances_mm=np.array([400.0, 500.0, 600.0, 900.0]))))


def test_a_model_that_falls_with_one_distance_says_which() -> None:
    fit = fit_curve(exact_sweep(distances_mm=np.linspace(400.0, 760.0, 10), hold_out=False))
    reasons = {one.model: one.reason for one in fit.rejected}
    assert re.match(r"with \d+\.0 mm left out: ", reasons["two-lines"])


def test_no_model_fits() -> None:
    fit_points = exact_sweep(distances_mm=np.linspace(400.0, 650.0, 9))
    with pytest.raises(CurveError, match=r"no model fits 7 stops .*0 distances after"):
        fit_curve(fit_points, models=["two-lines"])


def test_straight_slopes_are_no_camera() -> None:
    line = [make_point(z, 13.0 - 0.02 * z) for z in np.linspace(400.0, 900.0, 8).tolist()]
    fit = fit_curve(line)
    assert fit.best.model == "two-lines"
    assert {one.model for one in fit.rejected} == {"physical", "physical-curved"}


def test_linear_laws_hold_near_the_focus(physical_fit: CurveFit) -> None:
    laws = {(law.side, law.scope): law for law in physical_fit.laws}
    assert set(laws) == {(s, w) for s in ("before", "after") for w in ("side", "holds")}
    for side in ("before", "after"):
        whole, near = laws[side, "side"], laws[side, "holds"]
        assert near.max_pct <= 1.0 < whole.max_pct
        assert near.r2 > whole.r2 > 0.9
        assert near.stops < whole.stops
        assert near.px_per_mm < 0
    assert laws["before", "side"].distances_mm == (400.0, 650.0)
    assert laws["before", "holds"].distances_mm[1] == 650.0
    assert laws["after", "side"].distances_mm == (750.0, 1200.0)
    assert laws["after", "holds"].distances_mm[0] == 750.0


def test_linear_laws_of_exact_lines_are_exact() -> None:
    def law_px(z: float) -> float:
        return (700.0 - z) * (0.09 if z < 700.0 else 0.03)

    laws = fit_curve(exact_sweep(law_px, hold_out=False), models=["two-lines"]).laws
    for law in laws:
        assert law.px_per_mm == pytest.approx(-0.09 if law.side == "before" else -0.03)
        assert law.zero_mm == pytest.approx(700.0)
        assert law.r2 == pytest.approx(1.0)
        assert law.max_px == pytest.approx(0.0, abs=1e-9)
        assert law.max_pct == pytest.approx(0.0, abs=1e-9)


def test_a_side_with_two_distances_has_no_law() -> None:
    fit = fit_curve(
        exact_sweep(distances_mm=np.linspace(400.0, 760.0, 10), hold_out=False),
        models=["physical"],
    )
    assert {law.side for law in fit.laws} == {"before"}


def test_a_point_beyond_the_fitted_range_judges_nothing() -> None:
    outside = make_point(1300.0, physical_px(1300.0), role="holdout")
    fit = fit_curve([*exact_sweep(hold_out=False), outside], models=["physical"])
    assert fit.holdout is None
    assert fit.warnings == (
        "the stop at 1300.000 mm (forward) was held out but lies outside the fitted "
        "400.0-1200.0 mm; it judges nothing",
    )


def test_one_distance_has_one_role() -> None:
    both = CurvePoint(400.02, physical_px(400.02), 0.0, 0.0, 5, "holdout", "backward")
    with pytest.raises(CurveError, match=r"400\.000 mm .* 400\.020 mm .* one distance"):
        fit_curve([*exact_sweep(), both])
