"""Pairs, matchers, colours and boards of a comparison in numbers that are known beforehand."""

import cv2
import numpy as np
import pytest

from rig.compare.baselines import BASELINES, rows_met
from rig.compare.distances import BoardPlane
from rig.compare.frames import METHODS
from rig.compare.pair import Pair, best_pair
from rig.compare.plots import common_scale, in_colour
from rig.epipolar import RectifiedViews
from rig.epipolar.mending.row_errors import RowErrors
from rig.errors import SlopeError
from rig.measurement import Measurement

SAD = next(method for method in BASELINES if method.name == "SAD")


def textured(shape: tuple[int, int], seed: int = 1) -> np.ndarray:
    fine = np.random.default_rng(seed).uniform(20.0, 235.0, shape)
    return cv2.GaussianBlur(fine, (0, 0), 1.0)


def shifted_pair(disparity_px: int, shape: tuple[int, int] = (40, 90)) -> RectifiedViews:
    """Two views two steps apart of a wall with one disparity of whole pixels."""
    wide = textured((shape[0], shape[1] + 80)).astype(np.uint8)
    left = wide[:, 40 : 40 + shape[1]]
    right = wide[:, 40 + disparity_px : 40 + disparity_px + shape[1]]
    return RectifiedViews(np.stack([left, right]), np.array([0.0, 2.0]), np.zeros(2), 0)


@pytest.mark.parametrize("disparity_px", [-7, -1, 0, 3, 12])
def test_a_window_meets_whole_disparities_to_the_last_bit(disparity_px: int):
    views = shifted_pair(disparity_px)
    slope_px = SAD.run(views, (-5.0, 7.0))  # disparities -10..14, 32 of them from -13
    inner = slope_px[6:-6, 20:-20]
    # A parabola through sums of differences is symmetric about a perfect match only nearly.
    assert np.abs(inner * 2.0 - disparity_px).max() < 0.5
    assert abs(np.median(inner) * 2.0 - disparity_px) < 0.05


def test_what_no_shift_can_show_has_no_answer():
    """Two disparities of 16 that are searched lie within the picture at its far columns only."""
    views = shifted_pair(12)
    slope_px = SAD.run(views, (5.5, 6.5))  # disparities 5..20
    assert np.isnan(slope_px[:, :5]).all()
    assert np.isfinite(slope_px[:, 5:]).all()


@pytest.mark.parametrize(
    ("shape", "is_refused"),
    [((40, 25), True), ((40, 26), False), ((9, 60), True), ((10, 60), False)],
)
def test_a_picture_must_hold_the_search_and_a_window(shape: tuple[int, int], is_refused: bool):
    """16 disparities and a window of 9 px."""
    views = shifted_pair(1, shape)
    if is_refused:
        with pytest.raises(SlopeError, match="for 16 disparities"):
            SAD.run(views, (0.0, 1.0))
    else:
        assert SAD.run(views, (0.0, 1.0)).shape == shape


def test_rows_that_do_not_miss_are_left_as_they_are():
    views = shifted_pair(3)
    assert rows_met(views, RowErrors.none(2)) is views


def test_the_first_of_the_methods_is_ours_and_every_name_is_there_once():
    names = [method.name for method in METHODS]
    assert names == [
        "rig", "SAD", "StereoBM", "SGBM-3WAY", "SGBM-HH", "SGBM-3WAY filled", "SGBM-HH filled",
    ]  # fmt: skip


# --- pairs


def pair_with(baseline_steps: float = 1.0) -> Pair:
    image = np.zeros((4, 6), np.uint8)
    return Pair(image, image, 1, baseline_steps, is_transposed=False, is_mirrored=False)


@pytest.mark.parametrize(
    ("range_px", "baseline", "first", "count"),
    [
        ((0.0, 15.0), 1.0, 0, 16),
        ((0.0, 16.0), 1.0, -7, 32),  # 17 are needed, 15 are shared: 7 before, 8 behind
        ((-2.5, 2.5), 2.0, -7, 16),  # -5..5 are 11
        ((-1.2, 1.2), 1.0, -7, 16),  # -2..2 are 5
        ((3.0, 3.5), 1.0, -4, 16),
    ],
)
def test_disparities_come_in_blocks_of_sixteen(
    range_px: tuple[float, float], baseline: float, first: int, count: int
):
    assert pair_with(baseline).disparities(range_px) == (first, count)


def views_at(*places: tuple[float, float]) -> RectifiedViews:
    x, y = np.array([(0.0, 0.0), *places]).T
    return RectifiedViews(np.zeros((len(x), 4, 6), np.uint8), x, y, 0)


@pytest.mark.parametrize(
    ("place", "is_transposed", "is_mirrored"),
    [
        ((1.0, 0.0), False, False),
        ((-1.0, 0.0), False, True),
        ((0.0, 1.0), True, False),
        ((0.0, -1.0), True, True),
    ],
)
def test_a_pair_is_turned_as_its_partner_lies(
    place: tuple[float, float], is_transposed: bool, is_mirrored: bool
):
    pair = best_pair(views_at(place))
    assert (pair.is_transposed, pair.is_mirrored) == (is_transposed, is_mirrored)
    assert pair.baseline_steps == 1.0


@pytest.mark.parametrize(("off", "is_pair"), [(0.02, True), (0.021, False)])
def test_a_partner_may_lie_a_hundredth_off(off: float, is_pair: bool):
    if is_pair:
        assert best_pair(views_at((2.0, off))).baseline_steps == 2.0
        assert best_pair(views_at((off, -2.0))).is_transposed
    else:
        with pytest.raises(SlopeError, match="none of 1 views"):
            best_pair(views_at((2.0, off)))


def test_deeper_pictures_are_stretched_to_what_both_of_them_hold():
    images = np.zeros((2, 4, 6), np.uint16)
    images[0, 0, 0], images[1, 0, 0] = 1100, 600
    images[0, 0, 1:], images[1, 0, 1:] = 100, 350
    images[:, 1:] = 100
    views = RectifiedViews(images, np.array([0.0, 1.0]), np.zeros(2), 0)
    pair = best_pair(views)
    assert (int(pair.left[0, 0]), int(pair.left[0, 1])) == (255, 0)
    # 500 and 250 of 1000, in 255 parts.
    assert (int(pair.right[0, 0]), int(pair.right[0, 1])) == (128, 64)


# --- boards


def test_the_plane_of_a_board_is_told_at_every_pixel():
    measurement = Measurement(
        slope_px=4.0, plane=(4.0, 0.01, -0.02), centre_px=(20.0, 10.0),
        outline_px=((5.0, 4.0), (30.0, 4.0), (30.0, 15.0), (5.0, 15.0)),
    )  # fmt: skip
    board = BoardPlane.of(measurement, (24, 40))
    assert board is not None
    v, u = np.indices((24, 40))
    assert board.plane_px == pytest.approx(4.0 + 0.01 * (u - 20.0) - 0.02 * (v - 10.0), abs=1e-6)
    inside = (u >= 5) & (u <= 30) & (v >= 4) & (v <= 15)
    assert np.array_equal(board.inside, inside)
    assert board.centre_px == (20.0, 10.0)
    # Six disparities either way, over the baseline.
    low, high = board.plane_px[inside].min(), board.plane_px[inside].max()
    assert board.window_px(2.0) == pytest.approx((low - 3.0, high + 3.0))


@pytest.mark.parametrize("lost", ["plane", "centre_px", "outline_px"])
def test_a_board_without_its_plane_place_or_outline_is_none(lost: str):
    known = {
        "plane": (4.0, 0.0, 0.0), "centre_px": (20.0, 10.0),
        "outline_px": ((5.0, 4.0), (30.0, 4.0), (30.0, 15.0)),
    }  # fmt: skip
    assert BoardPlane.of(Measurement(slope_px=4.0, **(known | {lost: None})), (24, 40)) is None  # pyright: ignore[reportArgumentType]


# --- colours


def test_one_scale_for_all_but_the_outermost_hundredths():
    values = np.arange(201, dtype=np.float32).reshape(1, -1)
    assert common_scale(values) == pytest.approx((2.0, 198.0))
    assert common_scale(np.full((2, 2), np.nan, np.float32)) == (0.0, 1.0)
    assert common_scale(np.full((2, 2), 7.0, np.float32)) == pytest.approx((7.0, 7.0 + 1e-6))
    assert common_scale(np.full((2, 2), 7.0, np.float32))[1] > 7.0


@pytest.mark.parametrize("near_is_large", [True, False])
def test_near_is_warm_in_red_green_and_blue(near_is_large: bool):
    values = np.array([[10.0, 15.2, 20.0, 99.0, -99.0, np.nan]], np.float32)
    shares = np.array([0.0, 0.52, 1.0, 1.0, 0.0])
    levels = (255.0 * (shares if near_is_large else 1.0 - shares)).astype(np.uint8)
    table = cv2.applyColorMap(levels[None], cv2.COLORMAP_TURBO)[0, :, ::-1]
    colours = in_colour(values, (10.0, 20.0), near_is_large=near_is_large)
    assert np.array_equal(colours[0, :5], table)
    assert colours[0, 5].tolist() == [128, 128, 128]
