"""What followed frames take over from the frame before, and when it is measured anew."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar import RectifiedViews, SlopeMap, SlopePrior, estimate_slopes
from rig.epipolar.search.window import window_of
from rig.epipolar.steady import Steady, Turn
from tests.unit.epipolar.conftest import Scene


def following(
    views: RectifiedViews, range_px: tuple[float, float], last: SlopeMap, *, anew: bool = False
) -> SlopeMap:
    sigma_px = np.maximum(last.sigma_px, np.float32(0.2))
    prior = SlopePrior(last.slope_px, sigma_px, None if anew else last.steady)
    return estimate_slopes(replace(views, mending=last.mending), range_px, prior)


def median_error_px(scene: Scene, found: SlopeMap) -> float:
    return float(np.nanmedian(np.abs(found.slope_px - scene.slope_px)))


def steady_of(found: SlopeMap) -> Steady:
    assert found.steady is not None
    return found.steady


def test_everything_takes_its_turn(ball: Scene) -> None:
    found = estimate_slopes(ball.views, ball.range_px)
    turns = []
    for _ in range(5):
        turns.append(steady_of(found).turn)
        found = following(ball.views, ball.range_px, found)
    assert turns == [Turn.GAINS, Turn.NOISE, Turn.DRIFT, Turn.UNKNOWN, Turn.GAINS]


def test_only_what_is_due_is_measured(ball: Scene) -> None:
    first = estimate_slopes(ball.views, ball.range_px)
    before = steady_of(first)
    marked = replace(before, turn=Turn.DRIFT, pooled_share=0.875)
    found = steady_of(following(ball.views, ball.range_px, replace(first, steady=marked)))
    assert found.pooled_share == 0.875
    assert found.gains is before.gains
    assert found.grading is before.grading
    noise_is_due = replace(marked, turn=Turn.NOISE)
    found = steady_of(following(ball.views, ball.range_px, replace(first, steady=noise_is_due)))
    assert found.pooled_share != 0.875
    assert found.gains is before.gains
    assert found.grading is not before.grading


def test_more_unknown_pixels_are_looked_into_at_once(ball: Scene) -> None:
    steady = replace(
        steady_of(estimate_slopes(ball.views, ball.range_px)), turn=Turn.GAINS, wide_share=0.02
    )
    assert not steady.is_due(Turn.UNKNOWN, 0.0269)
    assert steady.is_due(Turn.UNKNOWN, 0.0271)
    assert not steady.is_due(Turn.NOISE, 0.0271)
    assert replace(steady, turn=Turn.UNKNOWN).is_due(Turn.UNKNOWN, 0.0)


def test_followed_frames_are_as_good_as_if_all_were_measured_anew(ball: Scene) -> None:
    kept = anew = estimate_slopes(ball.views, ball.range_px)
    for _ in range(4):
        kept = following(ball.views, ball.range_px, kept)
        anew = following(ball.views, ball.range_px, anew, anew=True)
    # What is told anew is smoothed and gets a second step, which live frames do without.
    assert median_error_px(ball, kept) < 1.3 * median_error_px(ball, anew)
    bad_kept, bad_anew = (
        float(np.mean(~(np.abs(found.slope_px - ball.slope_px) < 0.5))) for found in (kept, anew)
    )
    assert bad_kept < bad_anew + 0.005
    scaled = (kept.slope_px - ball.slope_px) / kept.sigma_px
    assert 0.5 < 1.4826 * np.nanmedian(np.abs(scaled)) < 1.4


def test_a_gain_that_changes_is_found_when_its_turn_comes(ball: Scene) -> None:
    found = estimate_slopes(ball.views, ball.range_px)
    good_px, gain = median_error_px(ball, found), steady_of(found).gains.gain[3]
    found = following(ball.views, ball.range_px, found)
    images = ball.views.images.astype(np.float64)
    images[3] *= 0.9
    darker = replace(ball.views, images=np.rint(images).astype(np.uint8))
    gains: list[float] = []
    for _ in Turn:
        found = following(darker, ball.range_px, found)
        gains.append(float(steady_of(found).gains.gain[3] / gain))
    assert gains[-1] == pytest.approx(1 / 0.9, rel=0.02)
    assert gains[0] == pytest.approx(1.0, rel=0.02)
    for _ in range(2):
        found = following(darker, ball.range_px, found)
    assert median_error_px(ball, found) < 1.3 * good_px


def test_what_other_views_told_is_not_taken_over(ball: Scene) -> None:
    found = estimate_slopes(ball.views, ball.range_px)
    wrong = replace(steady_of(found), x_steps=ball.views.x_steps + 0.1, pooled_share=0.875)
    followed = following(ball.views, ball.range_px, replace(found, steady=wrong))
    assert steady_of(followed).pooled_share != 0.875
    assert not wrong.is_of(ball.views.x_steps, ball.views.y_steps)


def test_a_search_of_the_whole_range_starts_all_turns_afresh(ball: Scene) -> None:
    found = estimate_slopes(ball.views, ball.range_px)
    lost = replace(
        found,
        slope_px=np.full_like(found.slope_px, np.nan),
        steady=replace(steady_of(found), turn=Turn.DRIFT),
    )
    assert steady_of(following(ball.views, ball.range_px, lost)).turn is Turn.GAINS


def test_what_was_unknown_before_is_no_reason_to_search_everything(ball: Scene) -> None:
    found = estimate_slopes(ball.views, ball.range_px)
    slope_px = found.slope_px.copy()
    slope_px[30:70, 40:84] = np.nan  # a seventh of the picture
    partly = replace(found, slope_px=slope_px)
    followed = following(ball.views, ball.range_px, partly)
    assert steady_of(followed).turn is Turn.NOISE
    assert median_error_px(ball, followed) < 0.02
    assert np.isfinite(followed.slope_px[30:70, 40:84]).mean() > 0.98
    assert steady_of(following(ball.views, ball.range_px, partly, anew=True)).turn is Turn.GAINS
    assert steady_of(followed).settled_share == pytest.approx(40 * 44 / found.label.size, abs=0.01)
    grown = replace(partly, steady=replace(steady_of(found), settled_share=0.1))
    assert steady_of(following(ball.views, ball.range_px, grown)).turn is Turn.GAINS


def test_more_unknown_than_before_is_a_reason_to_search_everything(ball: Scene) -> None:
    steady = steady_of(estimate_slopes(ball.views, ball.range_px))
    assert steady.settled_share is None
    assert steady.most_followed == 0.3
    assert replace(steady, settled_share=0.1).most_followed == pytest.approx(0.127)
    assert replace(steady, settled_share=0.5).most_followed == 0.3


def test_what_is_unknown_starts_from_the_last_guess(ball: Scene) -> None:
    found = estimate_slopes(ball.views, ball.range_px)
    slope_px = found.slope_px.copy()
    slope_px[3, 4] = np.nan
    guess_px = np.full_like(slope_px, 2.25)
    steady = replace(steady_of(found), slope_px=guess_px)
    range_px = ball.range_px
    with_guess = window_of(slope_px.shape, range_px, SlopePrior(slope_px, found.sigma_px, steady))
    without = window_of(slope_px.shape, range_px, SlopePrior(slope_px, found.sigma_px))
    assert with_guess.expected_px[3, 4] == 2.25
    assert without.expected_px[3, 4] == 1.0
    assert (with_guess.low_px[3, 4], with_guess.high_px[3, 4]) == range_px
    assert with_guess.expected_px[3, 5] == without.expected_px[3, 5] == slope_px[3, 5]


def test_colour_hands_nothing_on(ball: Scene) -> None:
    colour = np.repeat(ball.views.images[..., None], 3, axis=3)
    views = replace(ball.views, images=colour)
    assert estimate_slopes(views, ball.range_px).steady is None
