"""Pieces of the curve in closed form: tables, gradients, straight laws, borders of refusal."""

import numpy as np
import pytest

from rig.curve.least_squares import excess_variance_px2
from rig.curve.linear_laws import linear_laws
from rig.curve.models import _refuse_no_camera, _spline, fit_physical_curved, fit_two_lines
from rig.curve.physical import Physical, PhysicalCurved
from rig.curve.points import Stops, stops_of
from rig.curve.residuals import Residual, residuals_of
from rig.curve.spline import Spline
from rig.curve.table import EvenTable
from rig.errors import CurveError
from tests.support.curve_points import exact_sweep, make_point


def test_a_table_is_straight_between_its_nodes_and_goes_on_outside() -> None:
    table = EvenTable(10.0, 16.0, np.array([0.0, 6.0, 3.0, 3.5]))
    at = np.array([[10.0, 11.0, 12.0, 13.0], [14.0, 15.0, 16.0, 18.0], [8.0, 9.0, np.nan, 12.5]])
    found = table.at(at)
    assert found[:2].tolist() == [[0.0, 3.0, 6.0, 4.5], [3.0, 3.25, 3.5, 4.0]]
    assert found[2, [0, 1, 3]].tolist() == [-6.0, -3.0, 5.25]
    assert np.isnan(found[2, 2])
    assert table.at(np.array([11.0], np.float32)).dtype == np.float32


KNOTS = Spline((400.0, 500.0, 700.0, 1200.0), (26.0, 14.0, 0.0, -14.0))


def test_a_knot_moves_the_spline_where_it_stands_and_fades_to_its_neighbours() -> None:
    assert KNOTS.slope_gradient(np.array(KNOTS.knots_px)).tolist() == np.eye(4).tolist()
    between = KNOTS.slope_gradient(np.array([20.0, 3.5, -7.0]))
    assert between.tolist() == [
        [0.5, 0.5, 0.0, 0.0],
        [0.0, 0.25, 0.75, 0.0],
        [0.0, 0.0, 0.5, 0.5],
    ]
    assert KNOTS.fitted == ("knot_000_px", "knot_001_px", "knot_002_px", "knot_003_px")
    assert KNOTS.params()["knot_002_mm"] == 700.0
    assert Spline.from_params(KNOTS.params()) == KNOTS


def test_beyond_its_end_knots_a_spline_has_their_slopes() -> None:
    assert KNOTS.slope_px(np.array([100.0, 400.0, 1200.0, 9000.0])) == pytest.approx(
        [26.0, 26.0, -14.0, -14.0], abs=1e-9
    )
    with pytest.raises(ValueError, match="falling"):
        Spline((400.0, 500.0, 500.0), (3.0, 2.0, 1.0))
    with pytest.raises(ValueError, match="falling"):
        Spline((400.0, 500.0, 600.0), (3.0, 2.0, 2.0))
    with pytest.raises(TypeError, match="knot_000_mm"):
        Spline.from_params({"knot_000_mm": 1.0, "knot_000_px": 2.0, "knot_001_mm": 3.0})


def stops(*distances_mm: float) -> Stops:
    return stops_of([make_point(z, 1000.0 / z) for z in distances_mm])


@pytest.mark.parametrize(
    ("z0_mm", "a_px_mm", "is_refused"),
    [
        (399.9, 1.0, False),
        (400.0, 1.0, True),
        (401.0, 1.0, True),
        (0.0, 0.0, True),
        (0.0, -1.0, True),
        (400.0 - 0.9e3 * 600.0 + 1.0, 1.0, False),
        (400.0 - 0.9e3 * 600.0 - 1.0, 1.0, True),
    ],
)
def test_a_camera_stands_before_the_nearest_stop_and_not_beyond_the_ladder(
    z0_mm: float, a_px_mm: float, is_refused: bool
) -> None:
    law, seen = Physical(z0_mm, a_px_mm, 0.0), stops(400.0, 500.0, 1000.0)
    if is_refused:
        with pytest.raises(CurveError, match=r"are no camera that sees 400\.0-1000\.0 mm"):
            _refuse_no_camera(law, seen)
    else:
        _refuse_no_camera(law, seen)
        assert law.z0_mm == z0_mm


def test_the_curved_law_is_corrected_by_the_third_chebyshev_polynomial() -> None:
    law = PhysicalCurved(3.0, 24_000.0, -34.0, curvature_px=0.5, low_px=-10.0, high_px=30.0)
    slopes = np.array([-10.0, 0.0, 10.0, 20.0, 30.0])  # t = -1, -1/2, 0, 1/2, 1
    assert law.corrected_px(slopes) - slopes == pytest.approx([-0.5, 0.5, 0.0, -0.5, 0.5])
    # T3' = 12 t^2 - 3, and t grows by a twentieth per px.
    assert law.correction_rate(slopes) - 1 == pytest.approx([0.225, 0.0, -0.075, 0.0, 0.225])
    assert law.fitted == ("z0_mm", "a_px_mm", "m_inf_px", "curvature_px")


def test_four_distances_cannot_judge_a_curvature() -> None:
    with pytest.raises(CurveError, match="4 distances cannot judge a law of 4 parameters"):
        fit_physical_curved(stops(400.0, 500.0, 600.0, 700.0))


@pytest.mark.parametrize(
    ("slopes_px", "side"), [((3.0, -1.0, -2.0), "before"), ((3.0, 2.0, -1.0), "after")]
)
def test_either_side_of_the_focus_needs_two_distances(
    slopes_px: tuple[float, ...], side: str
) -> None:
    points = [make_point(400.0 + 100 * k, m) for k, m in enumerate(slopes_px)]
    with pytest.raises(CurveError, match=f"1 distance {side} the focus distance"):
        fit_two_lines(stops_of(points))


def test_neighbours_in_false_order_become_one_knot_of_their_mean() -> None:
    slopes_px = (20.0, 12.0, 14.0, 4.0, -3.0)
    points = [
        make_point(400.0 + 100 * k, m, sem_px=0.1, samples=5) for k, m in enumerate(slopes_px)
    ]
    law, variance_px2 = _spline(stops_of(points), 0.03)
    assert law.knots_mm == pytest.approx((400.0, 550.0, 700.0, 800.0))
    assert law.knots_px == pytest.approx((20.0, 13.0, 4.0, -3.0))
    assert variance_px2 == pytest.approx([0.04, 0.02, 0.04, 0.04])


def test_excess_makes_chi_square_equal_the_freedom() -> None:
    residual_px, variance_px2 = np.array([3.0, -3.0, 3.0]), np.full(3, 2.0)
    # 27 / (2 + x) = 2.
    found = excess_variance_px2(residual_px, variance_px2, freedom=2)
    assert found == pytest.approx(11.5, rel=1e-8)
    assert excess_variance_px2(residual_px, np.full(3, 13.5), freedom=2) == 0.0
    assert excess_variance_px2(residual_px, np.full(3, 14.0), freedom=2) == 0.0


def test_straight_laws_have_the_numbers_of_their_line() -> None:
    """Before the focus 0.1 px per mm exactly; after it 0.05 px per mm, off by 0.3 in the middle."""
    before = [make_point(z, (700.0 - z) * 0.1) for z in (400.0, 500.0, 600.0)]
    after = [make_point(z, m) for z, m in ((800.0, -4.9), (900.0, -10.2), (1000.0, -14.9))]
    laws = linear_laws([*before, *after])
    assert [(law.side, law.scope, law.stops) for law in laws] == [
        ("before", "side", 3), ("before", "holds", 3), ("after", "side", 3), ("after", "holds", 3),
    ]  # fmt: skip
    assert laws[0].distances_mm == (400.0, 600.0)
    assert (laws[0].px_per_mm, laws[0].zero_mm) == pytest.approx((-0.1, 700.0))
    assert (laws[0].r2, laws[0].max_px) == pytest.approx((1.0, 0.0), abs=1e-12)
    # Means 900 and -10; misses 0.1, -0.2, 0.1 of a slope of -0.05.
    assert (laws[2].px_per_mm, laws[2].zero_mm) == pytest.approx((-0.05, 700.0))
    assert laws[2].max_px == pytest.approx(0.2)
    assert laws[2].max_pct == pytest.approx(100 * 0.2 / 0.05 / 900.0)
    assert laws[2].r2 == pytest.approx(1 - 0.06 / (5.1**2 + 0.2**2 + 4.9**2))
    assert linear_laws(before[:2]) == ()


def test_a_line_holds_for_the_longest_run_from_the_focus() -> None:
    points = [make_point(z, (700.0 - z) * 0.05) for z in (700.0, 800.0, 900.0, 1000.0)]
    points += [make_point(1100.0, -14.0), make_point(1200.0, -14.5)]
    side, holds = linear_laws(points)
    assert (side.stops, holds.stops) == (6, 4)
    assert holds.distances_mm == (700.0, 1000.0)
    assert holds.px_per_mm == pytest.approx(-0.05)


def test_residuals_are_measured_less_the_curves() -> None:
    law = Physical(0.0, 20_000.0, -40.0)
    (found,) = residuals_of([make_point(500.0, 0.1)], law)
    assert found.error_px == pytest.approx(0.1)
    # dZ / dm = -a / 40^2 = -12.5 mm per px.
    assert found.error_mm == pytest.approx(-1.25)
    assert found.error_pct == pytest.approx(-0.25)
    assert Residual(make_point(200.0, 0.0), 0.0, 3.0).error_pct == 1.5
    assert residuals_of([], law) == ()
    assert len(residuals_of(exact_sweep(), law)) == 17
