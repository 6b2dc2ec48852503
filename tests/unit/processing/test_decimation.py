"""Decimation: means by inverse variance within one surface, and never across a jump."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rig.depth import DepthMap
from rig.depth.processing.decimation import decimated, decimated_picture
from rig.epipolar import Label, SlopeMap

JUMP_PX = 0.5


def slope_map(slope_px: NDArray[np.floating], sigma_px: NDArray[np.floating]) -> SlopeMap:
    slope_px = np.asarray(slope_px, np.float32)
    label = np.where(slope_px > 0, Label.NEARER, Label.BEYOND).astype(np.uint8)
    label[np.isnan(slope_px)] = Label.NONE
    return SlopeMap(slope_px, np.asarray(sigma_px, np.float32), label)


def one_square(values: list[float], sigmas: list[float]) -> tuple[float, float, int]:
    side = int(len(values) ** 0.5)
    given = slope_map(np.reshape(values, (side, side)), np.reshape(sigmas, (side, side)))
    found, _ = decimated(given, None, side, JUMP_PX)
    assert found.slope_px.shape == (1, 1)
    assert found.slope_px.dtype == found.sigma_px.dtype == np.float32
    return float(found.slope_px[0, 0]), float(found.sigma_px[0, 0]), int(found.label[0, 0])


NOTHING = float("nan")


def test_a_square_of_one_surface_is_its_mean_by_inverse_variance():
    slope_px, sigma_px, label = one_square([1.0, 1.1, 1.2, 1.3], [0.1, 0.1, 0.2, 0.2])
    weights = np.array([100.0, 100.0, 25.0, 25.0])
    assert slope_px == pytest.approx(weights @ [1.0, 1.1, 1.2, 1.3] / 250.0)
    assert sigma_px == pytest.approx((2 * 10.0 + 2 * 5.0) / 250.0)  # all errors alike
    assert label == Label.NEARER


def test_equal_sigmas_stay_as_they_are():
    assert one_square([1.0] * 4, [0.3] * 4)[:2] == pytest.approx((1.0, 0.3))


def test_the_larger_surface_is_taken_and_the_other_left_out():
    slope_px, sigma_px, _ = one_square([1.0, 5.0, 1.0, 1.0], [0.1, 0.001, 0.1, 0.1])
    assert (slope_px, sigma_px) == pytest.approx((1.0, 0.1))


def test_of_two_as_large_the_nearer_one_is_taken():
    assert one_square([1.0, 5.0, 5.0, 1.0], [0.1] * 4)[0] == pytest.approx(5.0)


@pytest.mark.parametrize(("gap_px", "mean_px"), [(0.49, 0.245), (0.51, 0.51)])
def test_a_jump_parts_what_is_less_does_not(gap_px: float, mean_px: float):
    assert one_square([0.0, gap_px, 0.0, gap_px], [0.1] * 4)[0] == pytest.approx(mean_px)


def test_pixels_without_an_answer_do_not_take_part():
    slope_px, sigma_px, label = one_square([NOTHING, -2.0, NOTHING, NOTHING], [NOTHING, 0.2] * 2)
    assert (slope_px, sigma_px, label) == pytest.approx((-2.0, 0.2, Label.BEYOND))
    nothing = one_square([NOTHING] * 4, [NOTHING] * 4)
    assert np.isnan(nothing[:2]).all()
    assert nothing[2] == Label.NONE


def test_a_tilted_surface_is_one():
    slope_px = 1.0 + 0.3 * np.arange(8.0) + 0.1 * np.arange(6.0)[:, None]
    found, _ = decimated(slope_map(slope_px, np.full((6, 8), 0.1)), None, 2, JUMP_PX)
    middle = 1.0 + 0.3 * (0.5 + 2 * np.arange(4.0)) + 0.1 * (0.5 + 2 * np.arange(3.0)[:, None])
    assert found.slope_px == pytest.approx(middle, rel=1e-5)
    assert found.sigma_px == pytest.approx(0.1, rel=1e-5)


def test_what_is_left_over_is_cut():
    found, _ = decimated(slope_map(np.ones((7, 11)), np.ones((7, 11))), None, 3, JUMP_PX)
    assert found.slope_px.shape == found.sigma_px.shape == found.label.shape == (2, 3)


def test_the_label_is_that_of_most_and_of_two_the_more_careful_one():
    given = slope_map(np.ones((2, 4)), np.ones((2, 4)))
    given.label[:] = [[3, 1, 4, 1], [1, 1, 4, 1]]
    found, _ = decimated(given, None, 2, JUMP_PX)
    assert found.label.tolist() == [[Label.NEARER, Label.FILLED]]


def test_a_mean_on_the_other_side_of_focus_is_labelled_so():
    assert one_square([0.1, 0.1, 0.1, -0.3], [1.0, 1.0, 1.0, 0.1])[2] == Label.BEYOND


def test_depth_goes_with_the_surface_of_its_slopes():
    given = slope_map(np.array([[1.0, 1.0, 5.0], [1.0, 5.0, 5.0]]), np.full((2, 3), 0.1))
    depth = DepthMap(
        np.array([[900.0, 930.0, 1.0], [NOTHING, 100.0, 1.0]], np.float32),
        np.array([[1.0, 2.0, 1.0], [NOTHING, 0.1, 1.0]], np.float32),
        np.array([[1, 1, 1], [0, 1, 1]], np.uint8),
    )
    found, fewer = decimated(given, depth, 2, JUMP_PX)
    assert fewer is not None
    assert found.slope_px[0, 0] == pytest.approx(1.0)
    assert fewer.depth_mm[0, 0] == pytest.approx((900.0 + 930.0 / 4) / 1.25)
    assert fewer.sigma_mm[0, 0] == pytest.approx((1.0 + 0.5) / 1.25)
    assert fewer.label[0, 0] == Label.NEARER
    nowhere = DepthMap(*(np.full((2, 3), NOTHING, np.float32),) * 2, np.zeros((2, 3), np.uint8))
    _, none = decimated(given, nowhere, 2, JUMP_PX)
    assert none is not None
    assert np.isnan(none.depth_mm).all()
    assert (none.label == 0).all()


@given(
    left=st.floats(-5, 5),
    jump=st.floats(0.6, 9),
    at=st.integers(0, 12),
    seed=st.integers(0, 99),
)
def test_no_value_lies_between_two_surfaces(left: float, jump: float, at: int, seed: int):
    rng = np.random.default_rng(seed)
    truth = np.where(np.arange(12) < at, left, left + jump) * np.ones((12, 1))
    sigma = rng.uniform(0.01, 3.0, truth.shape)
    found, _ = decimated(slope_map(truth, sigma), None, 4, JUMP_PX)
    away = np.minimum(np.abs(found.slope_px - left), np.abs(found.slope_px - left - jump))
    assert away.max() < 1e-5


def test_sigma_is_honest_for_errors_that_neighbours_share_or_not():
    rng = np.random.default_rng(5)
    shared = np.repeat(np.repeat(rng.standard_normal((60, 80)), 2, 0), 2, 1)
    own = rng.standard_normal(shared.shape)
    ratios: list[float] = []
    for error in (shared, own):
        given = slope_map(4.0 + 0.05 * error, np.full(error.shape, 0.05))
        found, _ = decimated(given, None, 2, JUMP_PX)
        ratios.append(float(np.std((found.slope_px - 4.0) / found.sigma_px)))
    assert ratios[0] == pytest.approx(1.0, abs=0.05)
    assert ratios[1] == pytest.approx(0.5, abs=0.03)  # on the safe side


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_pictures_are_averaged_in_their_type(dtype: type):
    image = np.array([[10, 20, 7], [30, 43, 7], [1, 1, 1]], dtype)
    found = decimated_picture(image, 2)
    assert found.tolist() == [[26]]  # 25.75
    assert found.dtype == dtype
