"""Where a board can be boards, against a pinhole camera in closed form."""

import numpy as np
import pytest

from rig.check.reach import Reach, judge_reach, predict_reach
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import Corners

BOARD = Checkerboard(9, 6, 25.0)
FOCAL_PX = 600.0
SIZE_PX = (640, 400)
PLAN_MM = (300.0, 1500.0)


def board_at(
    distance_mm: float,
    *,
    offset_mm: tuple[float, float] = (0.0, 0.0),
    centre_px: tuple[float, float] = (319.5, 199.5),
    square_mm: float = 25.0,
) -> dict[float, Corners]:
    board = Checkerboard(9, 6, square_mm)
    middle = board.points_mm[..., :2].reshape(-1, 2).mean(axis=0)
    place_mm = board.points_mm[..., :2] - middle + np.array(offset_mm)
    xy_px = np.array(centre_px) + FOCAL_PX * place_mm / distance_mm
    return {distance_mm: Corners(board, xy_px, np.full((6, 9), 0.02), 0.8, 150.0)}


def test_it_leaves_at_the_left_where_a_pinhole_says():
    """The outermost corner, 100 mm left of the middle, is 4 px from the border at one distance."""
    boards = board_at(800.0) | board_at(1000.0)
    reach = predict_reach("centre", boards, plan_mm=(150.0, 1500.0), size_px=SIZE_PX)
    # 319.5 - 600 * 100 / Z >= 4, and 199.5 - 600 * 62.5 / Z >= 4
    assert reach.nearest_mm == pytest.approx(FOCAL_PX * 62.5 / 195.5, rel=0.02)
    assert reach.side_px == pytest.approx((100.0, 10.0))


def test_squares_become_too_small_where_a_pinhole_says():
    boards = board_at(800.0, square_mm=10.0)
    reach = predict_reach("centre", boards, plan_mm=PLAN_MM, size_px=SIZE_PX)
    assert reach.farthest_mm == pytest.approx(FOCAL_PX * 10.0 / 6.0, rel=0.01)


def test_two_distances_know_a_centre_that_is_not_that_of_the_picture():
    shifted = board_at(700.0, centre_px=(400.0, 199.5)) | board_at(1100.0, centre_px=(400.0, 199.5))
    reach = predict_reach("left", shifted, plan_mm=(150.0, 1500.0), size_px=SIZE_PX)
    assert reach.nearest_mm == pytest.approx(FOCAL_PX * 100.0 / (635.0 - 400.0), rel=0.02)


def test_a_board_beside_the_picture_at_every_distance_is_nowhere():
    boards = board_at(700.0, offset_mm=(2000.0, 0.0)) | board_at(1100.0, offset_mm=(2000.0, 0.0))
    reach = predict_reach("left", boards, plan_mm=PLAN_MM, size_px=SIZE_PX)
    assert np.isnan(reach.nearest_mm)
    item = judge_reach([reach], reference="left", plan_mm=PLAN_MM, visited_mm=[700.0])
    assert item.status == "fail"
    assert "nowhere" in item.found
    assert "move board or camera" in item.advice


def whole(view: str) -> Reach:
    return Reach(view, *PLAN_MM, (50.0, 12.0))


def test_one_view_that_loses_the_board_is_a_warning_with_the_distance():
    short = Reach("top", 412.3, 1500.0, (50.0, 12.0))
    item = judge_reach(
        [whole("centre"), whole("left"), short],
        reference="centre", plan_mm=PLAN_MM, visited_mm=[900.0],
    )  # fmt: skip
    assert item.status == "warn"
    assert "top loses it nearer than 412 mm" in item.found
    assert "start at 413 mm" in item.advice


@pytest.mark.parametrize("names", [("centre",), ("left", "top")])
def test_without_the_reference_or_a_second_view_there_is_no_slope(names: tuple[str, ...]):
    short = [Reach(n, 300.0, 900.7, (50.0, 12.0)) for n in {"centre", "left", "top"} - set(names)]
    item = judge_reach(
        [*map(whole, names), *short], reference="centre", plan_mm=PLAN_MM, visited_mm=[900.0]
    )
    assert item.status == "fail"
    assert "end at 900 mm" in item.advice


def test_no_board_at_a_known_distance_is_skipped():
    item = judge_reach([], reference="centre", plan_mm=PLAN_MM, visited_mm=[])
    assert item.status == "skip"
