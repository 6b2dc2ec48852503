"""Where a board can be boards, against a pinhole camera in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from rig.check.reach import SMALL, Reach, judge_reach, predict_reach
from rig.targets.checkerboard import Checkerboard
from rig.targets.checkerboard_diagnosis import MIN_SIDE_PX
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


def nearest_place_mm(limit_mm: float, plan_mm: tuple[float, float], *, beyond: bool) -> float:
    """The place next to a limit among the 400 that are looked at, even in inverse distance."""
    places_mm = 1.0 / np.linspace(1.0 / plan_mm[0], 1.0 / plan_mm[1], 400)
    return float(
        places_mm[places_mm >= limit_mm].min() if beyond else places_mm[places_mm <= limit_mm].max()
    )


@pytest.mark.parametrize(
    ("offset_mm", "limit_mm"),
    [
        # The corner farthest off axis stays 4 px clear of the border from where Z >= f x / room.
        ((0.0, 0.0), FOCAL_PX * 62.5 / 195.5),
        ((60.0, 0.0), FOCAL_PX * 160.0 / 315.5),
        ((-60.0, 0.0), FOCAL_PX * 160.0 / 315.5),
        ((0.0, 30.0), FOCAL_PX * 92.5 / 195.5),
        ((0.0, -30.0), FOCAL_PX * 92.5 / 195.5),
    ],
)
@pytest.mark.parametrize("distances_mm", [(800.0,), (800.0, 1000.0)])
def test_each_border_is_met_at_the_place_next_to_where_a_pinhole_says(
    offset_mm: tuple[float, float], limit_mm: float, distances_mm: tuple[float, ...]
):
    boards = {
        at_mm: corners
        for distance_mm in distances_mm
        for at_mm, corners in board_at(distance_mm, offset_mm=offset_mm).items()
    }
    plan_mm = (150.0, 1500.0)
    reach = predict_reach("left", boards, plan_mm=plan_mm, size_px=SIZE_PX)
    assert reach.nearest_mm == pytest.approx(nearest_place_mm(limit_mm, plan_mm, beyond=True))
    assert reach.farthest_mm == pytest.approx(1500.0)


def test_the_least_square_is_met_at_the_place_next_to_where_a_pinhole_says():
    boards = board_at(800.0, square_mm=10.0)
    reach = predict_reach("left", boards, plan_mm=PLAN_MM, size_px=SIZE_PX)
    limit_mm = FOCAL_PX * 10.0 / MIN_SIDE_PX
    assert reach.farthest_mm == pytest.approx(nearest_place_mm(limit_mm, PLAN_MM, beyond=False))
    assert reach.nearest_mm == pytest.approx(PLAN_MM[0])
    assert reach.side_px == pytest.approx((20.0, 4.0))


def judged(*reaches: Reach) -> tuple[str, str, str]:
    item = judge_reach(
        reaches, reference="centre", plan_mm=PLAN_MM, visited_mm=[900.0, 300.0, 900.0]
    )
    return item.status, item.found, item.advice


def test_a_plan_within_reach_of_all_passes_with_its_numbers():
    item = judge_reach(
        [whole("centre"), Reach("left", *PLAN_MM, (52.0, 11.0))],
        reference="centre", plan_mm=PLAN_MM, visited_mm=[900.0, 300.0, 900.0],
    )  # fmt: skip
    assert (item.status, item.advice) == ("pass", "")
    assert item.found == (
        "squares of 52.0 px at 300 mm, 11.0 px at 1500 mm; in every view "
        "(from pictures at 300, 900 mm)"
    )
    assert item.numbers["nearest_mm"] == {"centre": 300.0, "left": 300.0}


@pytest.mark.parametrize(
    ("nearest_mm", "farthest_mm", "says"),
    [
        (300.001, 1499.999, ""),  # a millionth of the far end is rounding
        (300.01, 1500.0, "start at 301 mm"),
        (300.0, 1499.9, "end at 1499 mm"),
    ],
)
def test_rounding_is_no_loss(nearest_mm: float, farthest_mm: float, says: str):
    status, _, advice = judged(
        whole("centre"), whole("left"), Reach("top", nearest_mm, farthest_mm, (50.0, 12.0))
    )
    assert (status, advice[: len(says)], bool(advice)) == (
        "warn" if says else "pass",
        says,
        bool(says),
    )
    assert "; " not in advice


def test_the_views_that_lose_most_set_the_plan():
    _, found, advice = judged(
        whole("centre"), whole("left"),
        Reach("top", 410.2, 1500.0, (50.0, 12.0)), Reach("low", 390.0, 1200.8, (50.0, 12.0)),
        Reach("right", 300.0, 1300.0, (50.0, 12.0)),
    )  # fmt: skip
    assert advice.startswith("start at 411 mm")
    assert "end at 1200 mm" in advice
    assert "suits every view" not in advice
    assert (
        "top loses it nearer than 410 mm; low loses it nearer than 390 mm and beyond 1201 mm; "
        in found
    )
    assert "right loses it beyond 1300 mm" in found


def test_two_views_are_enough_if_one_is_the_reference():
    short = Reach("top", 412.3, 1500.0, (50.0, 12.0))
    assert judged(whole("centre"), whole("left"), short)[0] == "warn"
    assert judged(whole("left"), whole("right"), replace(short, view="centre"))[0] == "fail"
    assert judged(whole("centre"), short)[0] == "fail"


@pytest.mark.parametrize(("side_px", "status"), [(SMALL * MIN_SIDE_PX, "pass"), (7.7, "warn")])
def test_small_squares_are_told_by_the_view_with_the_smallest(side_px: float, status: str):
    got, _, advice = judged(whole("centre"), Reach("left", *PLAN_MM, (50.0, side_px)))
    assert got == status
    assert advice == ("use larger squares for a better far end" if status == "warn" else "")


def test_squares_that_are_small_and_lost_are_told_once():
    lost = Reach("left", 300.0, 1300.0, (50.0, 5.0))
    assert "better far end" not in judged(whole("centre"), whole("top"), lost)[2]
