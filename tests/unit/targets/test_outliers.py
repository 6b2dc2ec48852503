"""Corners that do not lie where a homography through their neighbours puts them."""

import numpy as np
import pytest

from rig.arrays import Float
from rig.targets import outliers
from rig.targets.outliers import inliers

TILTED = np.array([[30.0, 2.0, 40.0], [-3.0, 28.0, 35.0], [0.02, -0.015, 1.0]])


def corners(rows: int = 7, columns: int = 8) -> Float:
    row, column = np.mgrid[:rows, :columns].astype(np.float64)
    mapped = np.stack([column, row, np.ones_like(row)], axis=-1) @ TILTED.T
    return mapped[..., :2] / mapped[..., 2:]


def judged(xy_px: Float, sigma_px: float = 1e-4) -> list[list[int]]:
    kept = inliers(xy_px, np.full(xy_px.shape[:2], sigma_px))
    return np.argwhere(~kept).tolist()


@pytest.mark.parametrize("place", [(0, 0), (3, 4), (6, 7), (0, 5)])
def test_one_bad_corner_is_left_out_and_no_other(place: tuple[int, int]) -> None:
    xy_px = corners()
    xy_px[place] += (0.8, -0.6)
    assert judged(xy_px) == [list(place)]


@pytest.mark.parametrize(("off_px", "bad"), [(0.079, []), (0.081, [[3, 4]])])
def test_less_than_eight_hundredths_of_a_pixel_is_no_outlier(
    off_px: float, bad: list[list[int]]
) -> None:
    xy_px = corners()
    xy_px[3, 4] += off_px * np.array([0.6, 0.8])
    assert judged(xy_px) == bad


def spread() -> float:
    """Variance of a prediction from the 24 corners around, over that of one, by least squares."""
    y, x = np.mgrid[-2:3, -2:3].reshape(2, -1)[:, np.arange(25) != 12].astype(np.float64)
    one, none = np.ones(24), np.zeros(24)
    rows_u = np.stack([x, y, one, none, none, none, -x * x, -y * x], axis=1)
    rows_v = np.stack([none, none, none, x, y, one, -x * y, -y * y], axis=1)
    design = np.concatenate([rows_u, rows_v])
    middle = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    return float(np.sum((middle @ np.linalg.pinv(design)) ** 2))


@pytest.mark.parametrize(("share", "count"), [(0.98, 0), (1.02, 1)])
def test_five_sigmas_of_corner_and_prediction_are_allowed(share: float, count: int) -> None:
    row, column = np.mgrid[:7, :7].astype(np.float64)
    xy_px = 30 * np.stack([column, row], axis=-1)
    sigma_px = np.full((7, 7), 0.1)
    sigma_px[3, 3] = 0.2
    limit_px = 5 * np.sqrt(0.2**2 + spread() * 0.1**2)
    xy_px[3, 3, 0] += share * limit_px
    kept = inliers(xy_px, sigma_px)
    assert int((~kept).sum()) == count
    assert bool(kept[3, 3]) is (count == 0)


def test_where_all_miss_alike_six_times_the_median_is_allowed() -> None:
    numbers = np.random.default_rng(1)
    xy_px = corners() + numbers.normal(0, 0.1, (7, 8, 2))
    assert judged(xy_px) == []
    xy_px[3, 4] += (0.0, 1.2)
    assert judged(xy_px) == [[3, 4]]


def test_missing_corners_are_none_and_few_neighbours_judge_nothing() -> None:
    xy_px = corners()
    xy_px[0, 0] = xy_px[6, 3] = np.nan
    assert judged(xy_px) == [[0, 0], [6, 3]]
    assert judged(corners(2, 3) + np.eye(2, 3)[..., None]) == []
    places = np.stack(np.meshgrid(np.arange(4.0), np.arange(2.0)), axis=-1).reshape(-1, 2)
    miss_px, _ = outliers._misses(places, corners(2, 4).reshape(-1, 2), np.full(8, 0.1))
    # Of two rows of four the outer corners have five neighbours, the inner ones seven.
    assert np.isfinite(miss_px).tolist() == [False, True, True, False] * 2


def test_misses_are_distances_in_pixels_with_their_sigma() -> None:
    row, column = np.mgrid[:5, :5].astype(np.float64)
    places = np.stack([column, row], axis=-1).reshape(-1, 2)
    xy_px = 40 * places + np.array([100.0, 50.0])
    xy_px[12] += (0.3, 0.4)
    miss_px, sigma_px = outliers._misses(places, xy_px, np.full(25, 0.1))
    assert miss_px[12] == pytest.approx(0.5, abs=1e-9)
    assert sigma_px[12] == pytest.approx(0.1 * np.sqrt(1 + spread()), rel=0.01)
    assert np.isfinite(miss_px).all()
    assert miss_px[12] > 1.5 * np.delete(miss_px, 12).max()


def test_corners_on_one_line_tell_nothing() -> None:
    places = np.stack([np.arange(9.0), np.zeros(9)], axis=-1)
    miss_px, sigma_px = outliers._misses(places, 20 * places, np.full(9, 0.1))
    assert np.isnan(miss_px).all()
    assert np.isnan(sigma_px).all()
    assert inliers(20 * places[None], np.full((1, 9), 0.1)).all()


def test_the_worst_goes_first_and_so_on_up_to_a_dozen() -> None:
    xy_px = corners(17, 27)
    bad = [(r, c) for r in (3, 8, 13) for c in (3, 8, 13, 18, 23)]
    for number, place in enumerate(bad):
        xy_px[place] += (0.0, 5.0 + number)
    assert judged(xy_px) == [list(place) for place in bad[3:]]


def test_neighbours_along_one_line_predict_nothing() -> None:
    grid = np.argwhere(np.ones((5, 5))).astype(np.float64)
    places = np.stack([np.arange(25.0), np.zeros(25)], axis=-1)
    miss, sigma = outliers._misses(places, 20.0 * places, np.full(25, 0.01), grid)
    assert np.isnan(miss).all()
    assert np.isnan(sigma).all()


def test_neighbours_all_around_predict_a_tilted_board_exactly() -> None:
    row, column = np.mgrid[:5, :6].reshape(2, -1).astype(np.float64)
    places = np.stack([row, column], axis=-1)
    miss, sigma = outliers._misses(places, corners(5, 6).reshape(-1, 2), np.full(30, 0.01))
    assert np.nanmax(miss) < 1e-6
    assert np.isfinite(miss).all()
    assert float(np.nanmin(sigma)) > 0.01
