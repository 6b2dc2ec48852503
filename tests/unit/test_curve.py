"""A curve has limits and uncertainty, and survives JSON to the last digit."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.curve import ALL_MODELS, Curve, ModelName, fit_curve
from rig.errors import CurveError
from tests.support.curve_points import FOCUS_MM, exact_sweep, noisy_sweep, physical_px


@pytest.fixture(scope="module")
def curves() -> dict[ModelName, Curve]:
    return {c.curve.model: c.curve for c in fit_curve(noisy_sweep(seed=1)).candidates}


@pytest.fixture(params=ALL_MODELS)
def curve(request: pytest.FixtureRequest, curves: dict[ModelName, Curve]) -> Curve:
    return curves[request.param]


def test_noiseless_physical_sweep_gives_its_law_back() -> None:
    curve = fit_curve(exact_sweep()).best
    unseen_mm = np.array([417.0, 700.0, 1111.0])
    slopes_px = np.array([physical_px(z) for z in unseen_mm])
    np.testing.assert_allclose(curve.depth_mm(slopes_px), unseen_mm, rtol=1e-9)
    assert curve.model == "physical"
    assert curve.params == pytest.approx(
        {"z0_mm": 3.0, "a_px_mm": 24_000.0, "m_inf_px": -34.0}, rel=1e-9
    )
    assert curve.focus_mm == pytest.approx(FOCUS_MM, rel=1e-9)
    assert curve.focus_sigma_mm == pytest.approx(0.0, abs=1e-6)


def test_outside_the_domain_is_nan_and_nan_stays_nan(curve: Curve) -> None:
    low_px, high_px = curve.domain_px
    slopes_px = np.array([[low_px - 1e-6, low_px, high_px], [high_px + 1e-6, np.nan, -np.inf]])
    depth_mm = curve.depth_mm(slopes_px)
    assert depth_mm.shape == slopes_px.shape
    assert np.isnan(depth_mm).tolist() == [[True, False, False], [True, True, True]]
    np.testing.assert_allclose(depth_mm[0, 1:], curve.valid_mm[::-1], rtol=1e-6)
    sigma_mm = curve.depth_sigma_mm(slopes_px, np.full_like(slopes_px, 0.1))
    assert np.isnan(sigma_mm).tolist() == np.isnan(depth_mm).tolist()


def test_slope_px_is_the_inverse_inside_the_range(curve: Curve) -> None:
    distances_mm = np.array([399.0, 555.5, 1000.0, 1201.0])
    slopes_px = curve.slope_px(distances_mm)
    assert np.isnan(slopes_px).tolist() == [True, False, False, True]
    np.testing.assert_allclose(curve.depth_mm(slopes_px[1:3]), distances_mm[1:3], rtol=1e-9)


def test_a_picture_of_float32_stays_float32(curve: Curve) -> None:
    low_px, high_px = curve.domain_px
    slopes_px = np.linspace(low_px + 0.01, high_px - 0.01, 640 * 400).astype(np.float32)
    slopes_px = slopes_px.reshape(400, 640)
    depth_mm = curve.depth_mm(slopes_px)
    assert (depth_mm.dtype, depth_mm.shape) == (np.float32, (400, 640))
    assert curve.depth_sigma_mm(slopes_px, slopes_px * 0).dtype == np.float32
    np.testing.assert_allclose(depth_mm, curve.depth_mm(slopes_px.astype(np.float64)), rtol=1e-5)


def test_sigma_of_depth_joins_slope_and_curve(curve: Curve) -> None:
    slope_px = curve.slope_px(np.array([800.0]))
    rate = -curve.law.depth_per_slope(slope_px)
    own_px = curve.curve_sigma_px(np.array([800.0]))
    assert own_px[0] > 0
    alone_mm = curve.depth_sigma_mm(slope_px, np.zeros(1))
    np.testing.assert_allclose(alone_mm, own_px * rate)
    both_mm = curve.depth_sigma_mm(slope_px, np.array([0.05]))
    np.testing.assert_allclose(both_mm, np.hypot(own_px, 0.05) * rate)


def test_physical_covariance_reaches_depth_as_a_monte_carlo_says(
    curves: dict[ModelName, Curve],
) -> None:
    curve = curves["physical"]
    random = np.random.default_rng(0)
    draws = random.multivariate_normal(curve.law.fitted_values(), curve.covariance, 4000)
    slope_px = curve.slope_px(np.array([500.0, 1100.0]))
    depths_mm = np.array([curve.law.with_fitted(d).depth_mm(slope_px) for d in draws])
    sigma_mm = curve.depth_sigma_mm(slope_px, np.zeros(2))
    np.testing.assert_allclose(depths_mm.std(axis=0), sigma_mm, rtol=0.06)


def test_focus_outside_the_range_is_not_extrapolated() -> None:
    sweep = exact_sweep(distances_mm=np.linspace(400.0, 650.0, 9))
    curve = fit_curve(sweep, models=["physical"]).best
    assert curve.focus_mm is None
    assert curve.focus_sigma_mm is None


def test_json_round_trip_is_exact(curve: Curve) -> None:
    text = json.dumps(curve.to_json(), allow_nan=False)
    back = Curve.from_json(json.loads(text))
    assert back == curve
    slopes_px = np.linspace(*curve.domain_px, 100)
    np.testing.assert_array_equal(back.depth_mm(slopes_px), curve.depth_mm(slopes_px))
    np.testing.assert_array_equal(
        back.depth_sigma_mm(slopes_px, slopes_px * 0),
        curve.depth_sigma_mm(slopes_px, slopes_px * 0),
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"extra": 1}, "extra"),
        ({"model": "polynomial"}, "model: 'physical', .* or 'spline' wanted, found 'polynomial'"),
        ({"model": ["physical"]}, r"wanted, found \['physical'\]"),
        ({"params": {"z0_mm": 3.0, "a_px_mm": 24e3}}, "ill-formed"),
        (
            {"params": {"z0_mm": 3.0, "a_px_mm": 24e3, "m_inf_px": "x"}},
            "m_inf_px: a finite number wanted, found 'x'",
        ),
        (
            {"params": {"z0_mm": 3.0, "a_px_mm": 24e3, "m_inf_px": True}},
            "m_inf_px: a finite number wanted, found True",
        ),
        ({"params": [1, 2, 3]}, "ill-formed"),
        ({"params": {"z0_mm": 500.0, "a_px_mm": 24e3, "m_inf_px": -34.0}}, "does not fall"),
        ({"params": {"z0_mm": 3.0, "a_px_mm": -24e3, "m_inf_px": 34.0}}, "does not fall"),
        ({"covariance": [[1.0]]}, r"covariance of shape \(1, 1\)"),
        ({"covariance": [[1.0, 2.0], [3.0]]}, r"covariance of shape \(2, 1 or 2\)"),
        ({"covariance": [[-1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]}, "negative variance"),
        ({"covariance": 5}, "ill-formed"),
        ({"valid_mm": [400.0]}, r"valid_mm\[1\] is missing"),
        ({"valid_mm": [400.0, 300.0]}, "no range"),
        ({"valid_mm": [float("nan"), 300.0]}, r"valid_mm\[0\]: a finite number wanted, found nan"),
        ({"scatter_px": -1.0}, "negative variance"),
        ({"scatter_px": None}, "ill-formed"),
    ],
)
def test_from_json_refuses(
    change: dict[str, Any], says: str, curves: dict[ModelName, Curve]
) -> None:
    with pytest.raises(CurveError, match=says):
        Curve.from_json(curves["physical"].to_json() | change)


@pytest.mark.parametrize("missing", ["model", "params", "covariance", "valid_mm", "scatter_px"])
def test_from_json_refuses_a_missing_field(missing: str, curves: dict[ModelName, Curve]) -> None:
    content = curves["physical"].to_json()
    del content[missing]
    with pytest.raises(CurveError, match=f"{missing} is missing; run rig fit"):
        Curve.from_json(content)


ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3)
    ),
    max_leaves=6,
)


@settings(deadline=None, max_examples=150)
@given(
    field=st.sampled_from(["model", "params", "covariance", "valid_mm", "scatter_px"]),
    value=ANY_JSON,
)
def test_from_json_makes_a_curve_or_says_why_not(
    field: str, value: object, curves: dict[ModelName, Curve]
) -> None:
    content = curves["physical"].to_json() | {field: value}
    try:
        curve = Curve.from_json(content)
    except CurveError:
        return
    assert np.isfinite(curve.domain_px).all()
