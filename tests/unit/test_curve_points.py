"""Points of a curve as arrays: what is refused, which distances are one, how errors are pooled."""

from dataclasses import replace

import numpy as np
import pytest

from rig.curve.points import PRIOR_SAMPLES, same_distance, stops_of
from rig.errors import CurveError
from tests.support.curve_points import make_point


@pytest.mark.parametrize("distance_mm", [0.0, -1.0, np.inf, np.nan])
def test_a_distance_that_is_none_is_refused(distance_mm: float) -> None:
    with pytest.raises(CurveError, match="must be above 0 mm"):
        make_point(distance_mm, 1.0)


@pytest.mark.parametrize(
    "changes",
    [
        {"slope_px": np.nan},
        {"slope_px": np.inf},
        {"std_px": -1e-9},
        {"sem_px": -1e-9},
        {"std_px": np.nan},
        {"sem_px": np.inf},
    ],
)
def test_slopes_and_scatter_that_are_none_are_refused(changes: dict[str, float]) -> None:
    with pytest.raises(CurveError, match="finite and scatter not negative"):
        replace(make_point(500.0, 1.0), **changes)


def test_a_stop_has_a_sample_or_more() -> None:
    assert make_point(500.0, 1.0, samples=1, std_px=0.0, sem_px=0.0).samples == 1
    with pytest.raises(CurveError, match="0 samples"):
        make_point(500.0, 1.0, samples=0)


def test_distances_up_to_a_tenth_of_a_millimetre_are_one() -> None:
    # Sums of powers of two, so that no rounding decides.
    assert same_distance(np.array([500.0, 500.0625, 500.125, 500.25])).tolist() == [0, 0, 0, 1]
    assert same_distance(np.array([0.0, 0.1])).tolist() == [0, 0]
    assert same_distance(np.array([7.0])).tolist() == [0]


def test_standard_errors_are_moderated_by_the_pooled_one() -> None:
    points = [
        make_point(400.0, 2.0, samples=5, sem_px=0.3),
        make_point(500.0, 1.0, samples=9, sem_px=0.1),
        make_point(600.0, 0.0, samples=1, sem_px=0.7),
    ]
    stops = stops_of(points)
    pooled = (4 * 0.09 + 8 * 0.01) / 12
    expected = [
        (PRIOR_SAMPLES * pooled + freedom * sem2) / (PRIOR_SAMPLES + freedom)
        for freedom, sem2 in ((4, 0.09), (8, 0.01), (0, 0.49))
    ]
    assert stops.variance_px2 == pytest.approx(expected, rel=1e-12)
    assert stops.distances == 3


def test_noiseless_slopes_keep_a_variance_that_goes_with_their_span() -> None:
    variance = stops_of([make_point(400.0, 3.0), make_point(500.0, -1.0)]).variance_px2
    assert variance == pytest.approx([1.6e-23, 1.6e-23], rel=1e-9, abs=0.0)
    one = stops_of([make_point(400.0, 3.0, samples=1)])
    assert one.variance_px2 == pytest.approx([1e-48], rel=1e-9, abs=0.0)


def test_kept_stops_count_their_distances_anew() -> None:
    stops = stops_of([make_point(z, -z) for z in (400.0, 400.05, 500.0, 600.0, 600.05)])
    assert stops.group.tolist() == [0, 0, 1, 2, 2]
    kept = stops.keep(np.array([True, True, False, True, False]))
    assert kept.group.tolist() == [0, 0, 1]
    assert kept.distances == 2
    assert kept.distance_mm.tolist() == [400.0, 400.05, 600.0]
    assert kept.slope_px.tolist() == [-400.0, -400.05, -600.0]
