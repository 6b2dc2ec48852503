"""The board's plane as a hypothesis, and a dense map of the board as one slope."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar.board.dense import dense_board_slope, plane_prior
from rig.epipolar.board.slope import BoardSlope
from rig.epipolar.views import SlopeMap
from rig.errors import SlopeError
from rig.geometry.epipolar_error import EpipolarError

SHAPE = (120, 160)
OUTLINE = np.array([[30.0, 20.0], [130.0, 25.0], [125.0, 100.0], [35.0, 95.0]])
BOARD = BoardSlope(
    slope_px=1.5,
    sigma_px=1e-3,
    plane=(1.5, 0.004, -0.002),
    plane_covariance=np.diag([1e-6, 1e-9, 1e-9]),
    centre_px=(80.0, 60.0),
    corner_slope_px=1.5,
    corner_sigma_px=2e-3,
    track_residual_px=0.01,
    residual=0.5,
    edge_pixels=4000,
    side_px=10.0,
    period_px=14.0,
    epipolar=EpipolarError(0.0, 0.0, 0.0),
    corners_px=np.zeros((6, 9, 2)),
    across_px=np.zeros((3, 54)),
    outline_px=OUTLINE,
    views=(0, 1, 2),
    gains=(1.0, 1.0, 1.0),
    asymmetry_px=0.0,
)


def dense(*, noise: float, rng: np.random.Generator, offset: float = 0.0) -> SlopeMap:
    y, x = np.indices(SHAPE).astype(np.float64)
    slope = BOARD.slope_at(x, y) + offset + noise * rng.standard_normal(SHAPE)
    return SlopeMap(
        slope.astype(np.float32),
        np.full(SHAPE, max(noise, 1e-3), np.float32),
        np.ones(SHAPE, np.uint8),
    )


def test_the_prior_is_the_plane_on_the_board_and_nothing_beside_it():
    prior = plane_prior(BOARD, SHAPE)
    assert prior.slope_px[60, 80] == pytest.approx(1.5)
    assert prior.slope_px[70, 90] == pytest.approx(1.5 + 0.04 - 0.02)
    assert np.isnan(prior.slope_px[5, 5])
    assert (prior.sigma_px == np.float32(0.25)).all()


def test_the_prior_of_a_fine_board_is_well_under_a_quarter_period():
    fine = replace(BOARD, period_px=2.0)
    assert 2 * plane_prior(fine, SHAPE).sigma_px.max() <= 2.0 / 4


def test_a_dense_map_gives_the_slope_at_the_centre_with_its_sigma():
    fits = [
        dense_board_slope(dense(noise=0.05, rng=np.random.default_rng(seed), offset=0.2), BOARD)
        for seed in range(30)
    ]
    error = np.array([fit.slope_px for fit in fits]) - 1.7
    sigma = np.array([fit.sigma_px for fit in fits])
    assert np.sqrt(np.mean((error / sigma) ** 2)) == pytest.approx(1.0, abs=0.35)


def test_outliers_and_pixels_without_answer_do_not_count():
    slopes = dense(noise=0.01, rng=np.random.default_rng(0))
    slopes.slope_px[20:100:3, 30:130:2] += 8.0
    slopes.slope_px[40:50] = np.nan
    slopes.label[40:50] = 0
    fit = dense_board_slope(slopes, BOARD)
    assert fit.slope_px == pytest.approx(1.5, abs=2e-3)
    assert fit.pixels < 7000


def test_a_map_without_answers_is_refused():
    slopes = dense(noise=0.01, rng=np.random.default_rng(0))
    slopes.label[:] = 0
    with pytest.raises(SlopeError, match="0 pixels of the board"):
        dense_board_slope(slopes, BOARD)
