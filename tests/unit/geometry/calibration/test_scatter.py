"""Scales of residuals, against their closed forms."""

import numpy as np
import pytest

from rig.arrays import Float
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.scatter import (
    FREEDOM,
    OUTLIER_SIGMAS,
    SIGHTING_FREEDOM,
    Scatter,
    measure_scatter,
    point_weights,
)

MEDIAN_LENGTH = float(np.sqrt(2.0 * np.log(2.0)))
"""Of a normal error in two dimensions with sigma 1 in each."""


def observed(views: list[int], points: int, sigma_px: Float | float = 1.0) -> Observations:
    """One sighting of `points` points by each of `views`, all in one picture."""
    count = points * len(views)
    return Observations(
        pictures=(0,),
        start=np.arange(0, count + 1, points),
        picture=np.zeros(len(views), np.int64),
        view=np.array(views),
        ids=np.tile(np.arange(points), len(views)),
        xy_px=np.zeros((count, 2)),
        sigma_px=np.broadcast_to(np.asarray(sigma_px, float), (count,)).copy(),
    )


def of_length(*lengths_px: Float | float, points: int = 4) -> Float:
    """Residuals (M, 2) along the diagonal, one length for each sighting or one for each point."""
    each = [np.broadcast_to(np.asarray(one, float), (points,)) for one in lengths_px]
    return np.concatenate(each)[:, None] * np.array([0.6, -0.8])


def test_every_view_has_the_scale_of_its_own_residuals():
    scatter = measure_scatter(
        observed([0, 1, 0, 1], 4),
        of_length(*(length * MEDIAN_LENGTH for length in (0.5, 3.0, 0.5, 3.0))),
        view_count=3,
        floor_px=np.zeros(3),
    )
    assert scatter.view_scale == pytest.approx([0.5, 3.0, 1.0])
    assert scatter.sighting_scale == pytest.approx(np.ones(4))
    assert scatter.sigma_px == pytest.approx(np.repeat([0.5, 3.0, 0.5, 3.0], 4))
    assert scatter.distance == pytest.approx(np.full(16, MEDIAN_LENGTH))


def test_a_bad_sighting_is_believed_as_far_as_its_points_tell():
    lengths = [MEDIAN_LENGTH] * 3
    lengths[1] *= 4.0
    scatter = measure_scatter(observed([0, 0, 0], 4), of_length(*lengths), 1, np.zeros(1))
    bad = np.sqrt((SIGHTING_FREEDOM + 8 * 16.0) / (SIGHTING_FREEDOM + 8))
    assert scatter.view_scale == pytest.approx([1.0])
    assert scatter.sighting_scale == pytest.approx([1.0, bad, 1.0])
    assert scatter.sigma_px[4:8] == pytest.approx(np.full(4, bad))


def test_an_even_number_of_points_has_its_median_between_two():
    lengths = np.sqrt(np.array([1.0, 2.0, 6.0, 9.0]))
    scatter = measure_scatter(observed([0], 4), of_length(lengths), 1, np.zeros(1))
    assert scatter.view_scale[0] ** 2 == pytest.approx(4.0 / MEDIAN_LENGTH**2)
    odd = measure_scatter(observed([0], 3), of_length(lengths[:3], points=3), 1, np.zeros(1))
    assert odd.view_scale[0] ** 2 == pytest.approx(2.0 / MEDIAN_LENGTH**2)


def test_the_floor_is_added_in_squares_and_scaled_with_the_rest():
    scatter = measure_scatter(observed([0], 4, 3.0), of_length(10.0), 1, np.array([4.0]))
    scale = 10.0 / 5.0 / MEDIAN_LENGTH
    assert scatter.sigma_px == pytest.approx(np.full(4, 5.0 * scale))
    assert scatter.floor_px == pytest.approx([4.0])


def test_a_floor_is_found_where_errors_do_not_follow_what_the_detector_says():
    told_px = np.array([1.0, 1.0, 1.0, 1.0, 10.0, 10.0, 1.0, 1.0, 10.0, 10.0, 10.0, 10.0])
    alike, as_told = np.full(6, MEDIAN_LENGTH), told_px[6:] * MEDIAN_LENGTH
    scatter = measure_scatter(
        observed([0, 1], 6, told_px), of_length(alike, as_told, points=6), view_count=3
    )
    # The first view's typical sigma is 1 px; the largest floor that is tried is 8 of it.
    assert scatter.floor_px == pytest.approx([8.0, 0.0, 0.0])


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_points_that_are_told_to_be_far_worse_make_no_floor(seed: int):
    """Errors as told, a tenth of them on steep and small boards: the median of what a floor makes
    alike is small, but not its mean."""
    rng = np.random.default_rng(seed)
    told_px = np.exp(np.concatenate([rng.uniform(-0.4, 0.4, 480), rng.uniform(1.6, 3.2, 60)]))
    errors_px = rng.standard_normal((540, 2)) * told_px[:, None]
    scatter = measure_scatter(observed([0] * 9, 60, told_px), errors_px, 1)
    assert scatter.floor_px[0] <= 0.3
    assert scatter.view_scale[0] == pytest.approx(1.0, abs=0.1)


def test_points_that_are_nowhere_say_nothing():
    residual_px = of_length(MEDIAN_LENGTH, points=5)
    residual_px[4] = np.inf
    scatter = measure_scatter(observed([0], 5), residual_px, 1)
    assert np.isfinite(scatter.view_scale).all()
    assert point_weights(scatter, reject=False)[4] == 0.0
    assert point_weights(scatter, reject=True)[4] == 0.0
    nowhere = measure_scatter(observed([0], 2), np.full((2, 2), np.inf), 1)
    assert nowhere.floor_px == pytest.approx([0.0])


def test_residuals_that_vanish_keep_a_scale():
    scatter = measure_scatter(observed([0], 4), np.zeros((4, 2)), 1, np.zeros(1))
    assert scatter.view_scale == pytest.approx([1e-9])


def test_weights_are_inverse_variances_and_outliers_have_none():
    distance = np.array([0.0, 2.0, OUTLIER_SIGMAS, OUTLIER_SIGMAS + 0.01])
    ones = np.ones(1)
    scatter = Scatter(ones, ones, ones, np.full(4, 0.5), distance)
    assert point_weights(scatter, reject=True) == pytest.approx([4.0, 4.0, 4.0, 0.0])
    student = (FREEDOM + 2.0) / (FREEDOM + distance**2) * 4.0
    assert point_weights(scatter, reject=False) == pytest.approx(student)
