"""The temporal filter: closed forms of a Kalman filter, and honest where things move."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.depth.processing.temporal import SlopeFilter, sided
from rig.epipolar import Label, SlopeMap
from rig.profile.load import load_profile
from tests.support.lightfield import true_slope_px
from tests.unit.live.test_following import SHAPE, measured, multiview, scene

FRAMES = 8


def slopes(
    slope_px: float | NDArray[np.floating],
    sigma_px: float = 0.05,
    shape: tuple[int, int] = (60, 80),
) -> SlopeMap:
    values = np.broadcast_to(np.float32(slope_px), shape).astype(np.float32)
    label = np.where(values > 0, Label.NEARER, Label.BEYOND).astype(np.uint8)
    label[np.isnan(values)] = Label.NONE
    return SlopeMap(values, np.full(shape, sigma_px, np.float32), label)


def white(seed: int, share: float = 1.0, shape: tuple[int, int] = (60, 80)) -> NDArray[np.float64]:
    """Noise of a share of the sigma of `slopes`."""
    return 0.05 * share * np.random.default_rng(seed).standard_normal(shape)


def ratio(found: SlopeMap, truth: float | NDArray[np.floating]) -> float:
    """Robust standard deviation of error over sigma."""
    return float(1.4826 * np.nanmedian(np.abs((found.slope_px - truth) / found.sigma_px)))


def test_the_first_map_is_as_it_was_measured():
    first = slopes(1.0 + white(0))
    found = SlopeFilter(FRAMES).filtered(first)
    assert (found.slope_px == first.slope_px).all()
    assert (found.sigma_px == first.sigma_px).all()
    assert (found.label == first.label).all()


def test_two_maps_are_averaged_by_inverse_variance():
    one = SlopeFilter(1000)
    one.filtered(slopes(1.0, 0.05))
    found = one.filtered(slopes(1.03, 0.025))
    assert found.slope_px == pytest.approx((1.0 * 1 + 1.03 * 4) / 5, rel=1e-6)


def test_what_frames_have_in_common_stays_in_sigma():
    """A pattern of errors that never changes: averaging takes nothing of it away."""
    one, pattern = SlopeFilter(FRAMES), white(3)
    for _ in range(20):
        found = one.filtered(slopes(1.0 + pattern))
    assert found.slope_px == pytest.approx(1.0 + pattern, rel=1e-5)
    assert np.median(found.sigma_px) == pytest.approx(0.05, rel=0.1)
    assert found.sigma_px.max() <= np.float32(0.05)


def test_an_error_that_never_changes_anywhere_is_not_averaged_away():
    one = SlopeFilter(FRAMES)
    for _ in range(20):
        found = one.filtered(slopes(1.01))
    assert found.slope_px == pytest.approx(1.01)
    assert found.sigma_px == pytest.approx(0.05 * 0.1**0.5, rel=1e-2)


def test_white_noise_falls_as_a_fading_memory_lets_it():
    one = SlopeFilter(FRAMES)
    for number in range(40):
        found = one.filtered(slopes(1.0 + white(number)))
    gain = 1.0 / FRAMES
    error = 1.4826 * np.median(np.abs(found.slope_px - 1.0))  # few began anew by chance
    assert error == pytest.approx(0.05 * (gain / (2.0 - gain)) ** 0.5, rel=0.1)
    assert 0.8 < ratio(found, 1.0) < 1.25


@pytest.mark.parametrize("share", [0.7, 1.0])
def test_sigma_is_honest_in_every_frame(share: float):
    one = SlopeFilter(FRAMES)
    ratios = [ratio(one.filtered(slopes(1.0 + white(n, share))), 1.0) for n in range(16)]
    assert max(ratios) < 1.25
    assert min(ratios[1:]) > 0.5
    assert ratios[0] == pytest.approx(share, rel=0.05)


@pytest.mark.parametrize("step_px", [0.3, 3.0])
def test_what_jumps_is_as_measured_at_once(step_px: float):
    one = SlopeFilter(FRAMES)
    moved = np.zeros((60, 80))
    moved[:, 40:] = step_px  # the left half stays
    for number in range(10):
        one.filtered(slopes(1.0 + white(number)))
    now = slopes(1.0 + moved + white(99))
    found = one.filtered(now)
    assert (found.slope_px[:, 40:] == now.slope_px[:, 40:]).mean() > 0.95
    assert (found.sigma_px[:, 40:] == np.float32(0.05)).mean() > 0.95
    still = np.s_[:, :12]  # farther from the jump than its scatter is told
    assert (found.sigma_px[still] < 0.03).mean() > 0.95
    assert np.std(found.slope_px[still] - 1.0) < 0.02


@pytest.mark.parametrize("per_frame", [0.05, 0.2, 1.0])
def test_a_slow_motion_does_not_lag_beyond_sigma(per_frame: float):
    """Noise as alike among neighbours as stitching makes it."""
    one = SlopeFilter(FRAMES)
    ratios: list[float] = []
    for number in range(24):
        noise = cv2.GaussianBlur(white(number), (0, 0), 3.0)
        truth = 1.0 + 0.05 * per_frame * max(0, number - 8)
        found = one.filtered(slopes(truth + 0.035 * noise / noise.std()))
        ratios.append(ratio(found, truth))
        lag_px = truth - float(np.mean(found.slope_px))
        assert lag_px < 0.05
    assert max(ratios) < 2.4  # for a frame or two, until it is noticed
    assert np.median(ratios[8:]) < 1.6


def test_a_slope_that_the_views_contradict_is_not_averaged():
    one = SlopeFilter(FRAMES)
    for number in range(6):
        one.filtered(slopes(1.0 + white(number)))
    blind = slopes(1.1, 2.0)
    found = one.filtered(blind)
    assert (found.slope_px == blind.slope_px).all()
    assert (found.sigma_px == 2.0).all()


def test_pixels_without_an_answer_stay_without_and_begin_anew():
    one = SlopeFilter(FRAMES)
    for number in range(6):
        one.filtered(slopes(1.0 + white(number)))
    hole = 1.0 + white(7)
    hole[20:30, 20:30] = np.nan
    found = one.filtered(slopes(hole))
    assert np.isnan(found.slope_px[20:30, 20:30]).all()
    assert np.isfinite(found.slope_px).sum() == 60 * 80 - 100
    assert (found.label[20:30, 20:30] == Label.NONE).all()
    back = slopes(1.0 + white(8))
    again = one.filtered(back)
    assert (again.slope_px[20:30, 20:30] == back.slope_px[20:30, 20:30]).all()
    assert (again.slope_px != back.slope_px)[:15].mean() > 0.9


def test_a_filter_that_forgets_gives_the_next_map_as_it_is():
    one = SlopeFilter(FRAMES)
    one.filtered(slopes(1.0))
    one.forget()
    now = slopes(1.02)
    assert (one.filtered(now).slope_px == now.slope_px).all()


def test_labels_follow_the_side_and_keep_what_names_none():
    label = np.array([[0, 1, 1, 2, 2, 3, 4]], np.uint8)
    slope_px = np.array([[np.nan, 1, -1, 1, 0, -1, 1]], np.float32)
    assert sided(label, slope_px).tolist() == [[0, 1, 2, 1, 2, 3, 4]]


def test_warnings_and_mending_of_the_measured_map_are_kept():
    told = replace(slopes(1.0), warnings=("a view is black",))
    assert SlopeFilter(FRAMES).filtered(told).warnings == ("a view is black",)


@pytest.mark.slow
def test_pictures_with_noise_give_slopes_of_an_honest_sigma():
    overrides = ["slopes.range_px=[-8.0, 12.0]", "processing.temporal_frames=8"]
    profile = load_profile("sim", overrides)
    still, after = scene(-4.0, 6.0, left=True), scene(-3.0, 7.0, left=False)
    stream = [multiview(profile, still, n) for n in range(10)]
    stream += [multiview(profile, after, n) for n in range(10, 13)]
    frames = measured(profile, stream)
    truth = true_slope_px(still, SHAPE)
    ratios = [ratio(frame.slopes, truth) for frame in frames[:10]]
    assert all(0.7 < one < 1.25 for one in ratios), ratios
    errors = [float(np.nanmedian(np.abs(f.slopes.slope_px - truth))) for f in frames[:10]]
    assert errors[9] < 0.6 * errors[1]
    bad = np.abs(frames[-1].slopes.slope_px - true_slope_px(after, SHAPE)) > 0.5
    assert float(np.mean(bad)) < 0.1  # as without the filter, see test_following
