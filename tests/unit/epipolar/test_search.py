import numpy as np

from rig.epipolar import RectifiedViews, SlopePrior, estimate_slopes
from rig.epipolar.search.window import Cameras, window_of
from tests.unit.epipolar.conftest import Scene


def test_a_hypothesis_as_wide_as_the_range_is_none() -> None:
    slope = np.zeros((4, 5), np.float32)
    sigma = np.full((4, 5), 0.5, np.float32)
    sigma[:, 3:] = 3.0
    window = window_of((4, 5), (-6.0, 4.0), SlopePrior(slope, sigma))
    assert np.all(window.low_px[:, :3] == -1.0)
    assert np.all(window.high_px[:, :3] == 1.0)
    assert np.all(window.low_px[:, 3:] == -6.0)
    assert np.all(window.high_px[:, 3:] == 4.0)


def test_labels_are_finer_where_views_stand_wider() -> None:
    near = Cameras(np.array([0.0, 1.0]), np.zeros(2), 0)
    wide = Cameras(np.array([0.0, 4.0]), np.zeros(2), 0)
    assert wide.step_px == near.step_px / 4


def test_a_wide_range_is_searched_coarsely_and_still_found(ball: Scene) -> None:
    error = np.abs(estimate_slopes(ball.views, (-30.0, 30.0)).slope_px - ball.slope_px)
    assert np.nanmedian(error) < 0.03
    assert np.nanmean(error > 0.5) < 0.05


def test_the_last_frame_as_hypothesis_is_as_good_as_a_new_search(ball: Scene) -> None:
    first = estimate_slopes(ball.views, ball.range_px)
    prior = SlopePrior(first.slope_px, first.sigma_px)
    second = estimate_slopes(ball.views, ball.range_px, prior)
    error = np.abs(second.slope_px - ball.slope_px)
    assert np.nanmedian(error) < 0.02
    assert np.nanmean(error > 0.5) < 0.03


def test_after_a_jump_of_the_scene_the_second_frame_is_right(ball: Scene) -> None:
    wrong = SlopePrior(
        np.full(ball.slope_px.shape, 6.0, np.float32), np.full(ball.slope_px.shape, 0.1, np.float32)
    )
    lost = estimate_slopes(ball.views, ball.range_px, wrong)
    assert np.nanmean(np.abs(lost.slope_px - ball.slope_px) > 0.5) > 0.5
    prior = SlopePrior(lost.slope_px, lost.sigma_px)
    found = estimate_slopes(ball.views, ball.range_px, prior)
    assert np.nanmean(np.abs(found.slope_px - ball.slope_px) > 0.5) < 0.04


def test_a_repeated_pattern_stays_on_the_period_of_the_hypothesis() -> None:
    columns = np.arange(96, dtype=float)
    true_px = 1.3
    x = np.array([-1.0, 0.0, 1.0])
    rows = [128 + 60 * np.sin(2 * np.pi * (columns + true_px * s) / 12) for s in x]
    images = np.stack([np.tile(row, (48, 1)) for row in rows]).astype(np.float32)
    views = RectifiedViews(images, x, np.zeros(3), 1)
    mean = np.full((48, 96), true_px + 0.6, np.float32)
    prior = SlopePrior(mean, np.full((48, 96), 0.75, np.float32))
    slopes = estimate_slopes(views, (-20.0, 20.0), prior)
    assert np.nanmedian(np.abs(slopes.slope_px - true_px)) < 0.1
    assert np.nanmax(np.abs(slopes.slope_px - mean)) <= 1.5 + 1e-5
