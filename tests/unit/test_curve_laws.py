"""Every law: depth and slope are inverse to each other, derivatives are those of the formula."""

import numpy as np
import pytest

from rig.curve.law import Law
from rig.curve.physical import Physical, PhysicalCurved
from rig.curve.spline import Spline
from rig.curve.two_lines import TwoLines

PHYSICAL = Physical(3.0, 24_000.0, -34.0)
KNOTS_MM = np.linspace(350.0, 1300.0, 9)
LAWS: list[Law] = [
    PHYSICAL,
    PhysicalCurved(3.0, 24_000.0, -34.0, curvature_px=0.3, low_px=-14.0, high_px=27.0),
    TwoLines(700.0, -0.09, -0.03),
    Spline(tuple(KNOTS_MM.tolist()), tuple((PHYSICAL.slope_px(KNOTS_MM) + 0.1).tolist())),
]
DISTANCES_MM = np.linspace(410.0, 1190.0, 40)


def name(law: Law) -> str:
    return law.name


@pytest.fixture(params=LAWS, ids=name)
def law(request: pytest.FixtureRequest) -> Law:
    return request.param


def test_depth_undoes_slope(law: Law) -> None:
    back_mm = law.depth_mm(law.slope_px(DISTANCES_MM))
    np.testing.assert_allclose(back_mm, DISTANCES_MM, rtol=1e-12)


def test_depth_per_slope_is_the_derivative(law: Law) -> None:
    slope_px, step_px = law.slope_px(DISTANCES_MM), 1e-4
    rate = (law.depth_mm(slope_px + step_px) - law.depth_mm(slope_px - step_px)) / (2 * step_px)
    # The spline's table is straight between its nodes, which its derivative smooths.
    rtol = 2e-3 if isinstance(law, Spline) else 1e-6
    np.testing.assert_allclose(law.depth_per_slope(slope_px), rate, rtol=rtol)


@pytest.mark.parametrize("law", LAWS[:3], ids=name)
def test_slope_gradient_is_the_derivative_by_each_parameter(law: Law) -> None:
    gradient = law.slope_gradient(law.slope_px(DISTANCES_MM))
    values = law.fitted_values()
    for column, value in enumerate(values):
        step = np.zeros_like(values)
        step[column] = 1e-5 * max(abs(value), 1.0)
        higher = law.with_fitted(values + step).slope_px(DISTANCES_MM)
        lower = law.with_fitted(values - step).slope_px(DISTANCES_MM)
        rate = (higher - lower) / (2 * step[column])
        np.testing.assert_allclose(gradient[:, column], rate, rtol=1e-4, atol=1e-9)


def test_params_name_every_parameter_and_rebuild_the_law(law: Law) -> None:
    params = law.params()
    assert set(law.fitted) <= set(params)
    assert all(key.endswith(("_mm", "_px")) for key in params)
    assert type(law).from_params(params) == law


def test_float32_stays_float32(law: Law) -> None:
    slope_px = law.slope_px(DISTANCES_MM).astype(np.float32)
    assert law.depth_mm(slope_px).dtype == np.float32
    assert law.depth_per_slope(slope_px).dtype == np.float32
    np.testing.assert_allclose(law.depth_mm(slope_px), DISTANCES_MM, rtol=2e-6)


def test_curvature_is_the_largest_correction() -> None:
    law = PhysicalCurved(3.0, 24_000.0, -34.0, curvature_px=0.3, low_px=-14.0, high_px=27.0)
    slopes_px = np.linspace(-14.0, 27.0, 1001)
    correction_px = law.corrected_px(slopes_px) - slopes_px
    assert np.abs(correction_px).max() == pytest.approx(0.3)
    assert correction_px[-1] == pytest.approx(0.3)


def test_without_curvature_the_curved_law_is_the_physical_one() -> None:
    law = PhysicalCurved(3.0, 24_000.0, -34.0, curvature_px=0.0, low_px=-14.0, high_px=27.0)
    np.testing.assert_allclose(law.slope_px(DISTANCES_MM), PHYSICAL.slope_px(DISTANCES_MM))


def test_spline_goes_through_its_knots_and_falls_between_them() -> None:
    law = Spline((400.0, 500.0, 510.0, 900.0, 1200.0), (26.0, 14.0, 13.9, -7.0, -14.0))
    np.testing.assert_allclose(law.depth_mm(np.array(law.knots_px)), law.knots_mm, rtol=2e-5)
    slopes_px = law.slope_px(np.linspace(400.0, 1200.0, 500))
    assert np.all(np.diff(slopes_px) < 0)


def test_spline_knows_a_physical_rig_between_nine_distances() -> None:
    law = Spline(tuple(KNOTS_MM.tolist()), tuple(PHYSICAL.slope_px(KNOTS_MM).tolist()))
    error_mm = law.depth_mm(PHYSICAL.slope_px(DISTANCES_MM)) - DISTANCES_MM
    assert np.abs(error_mm / DISTANCES_MM).max() < 5e-5


@pytest.mark.parametrize(
    ("knots_mm", "knots_px"),
    [((400.0, 500.0), (1.0, 2.0)), ((500.0, 400.0), (2.0, 1.0)), ((400.0,), (1.0,))],
)
def test_spline_refuses_knots_that_do_not_fall(
    knots_mm: tuple[float, ...], knots_px: tuple[float, ...]
) -> None:
    with pytest.raises(ValueError, match="falling"):
        Spline(knots_mm, knots_px)


def test_at_the_focus_itself_the_side_after_it_counts() -> None:
    law = TwoLines(700.0, -0.09, -0.03)
    rates = law.depth_per_slope(np.array([1e-9, 0.0, -1e-9]))
    assert rates == pytest.approx([-1.0 / 0.09, -1.0 / 0.03, -1.0 / 0.03])
