"""What pictures cover, counted by hand, and the advice at each of its limits."""

from dataclasses import replace

import numpy as np
import pytest

from rig.calibrate.coverage import COLUMNS, ROWS, Coverage, coverage_of
from rig.calibrate.guide import advise, coverage_text
from rig.calibrate.in_hand import motion_px
from rig.calibrate.sight import PictureSightings
from rig.errors import TargetError
from rig.targets import Detection
from tests.unit.calibrate.test_guide import BOARD, NAMES, seen

GOOD = Coverage(
    cells=np.ones((2, ROWS, COLUMNS), np.intp),
    shared=np.array([[9, 6], [6, 7]], np.intp),
    tilts_deg=np.array([[15.0, 0.0], [-15.0, 0.0], [0.0, 15.0], [0.0, -15.0]]),
    distances_mm=np.array([500.0, 701.0]),
)
"""Everything just covered."""


def moved(one: PictureSightings, shift_px: tuple[float, float]) -> PictureSightings:
    """The same picture with all corners elsewhere."""
    by_view = tuple(
        replace(found, xy_px=found.xy_px + shift_px) if isinstance(found, Detection) else found
        for found in one.by_view
    )
    return replace(one, by_view=by_view)


def test_corners_are_counted_in_their_part_of_the_picture():
    """640 x 400 px in 5 x 4 parts of 128 x 100 px."""
    one = seen(0)
    detection = one.by_view[0]
    assert isinstance(detection, Detection)
    xy_px = np.full_like(detection.xy_px, 5.0)
    xy_px[:6] = [(127.9, 5.0), (128.0, 5.0), (300.0, 99.9), (300.0, 100.0), (5.0, 399.0),
                 (639.9, 399.9)]  # fmt: skip
    placed = replace(one, by_view=(replace(detection, xy_px=xy_px), one.by_view[1]))
    coverage = coverage_of([placed], BOARD, 2)
    wanted = np.zeros((ROWS, COLUMNS), int)
    wanted[0, 0] = len(xy_px) - 5
    wanted[0, 1] = wanted[0, 2] = wanted[1, 2] = wanted[3, 0] = wanted[3, 4] = 1
    assert (ROWS, COLUMNS) == (4, 5)
    assert coverage.cells[0].tolist() == wanted.tolist()
    assert coverage.area_share[0] == 6 / 20


def test_a_pair_is_what_both_views_saw():
    lost = TargetError("", reason="clipped")
    first, second = seen(0), seen(1)
    coverage = coverage_of(
        [first, replace(second, by_view=(lost, second.by_view[1]))], BOARD, 2
    )  # fmt: skip
    assert coverage.shared.tolist() == [[1, 1], [1, 2]]


def test_tilts_and_distances_are_those_of_the_boards():
    """A board turned by a about x has its lower side farther away where a is positive."""
    tilts = [(20, 0, 0), (-25, 0, 0), (0, 20, 0), (0, -25, 0), (15, 15, 0)]
    coverage = coverage_of(
        [seen(n, tilt_deg=tilt, at_mm=(0, 0, 600 + 20 * n)) for n, tilt in enumerate(tilts)],
        BOARD, 2,
    )  # fmt: skip
    assert coverage.tilts_deg[:4] == pytest.approx(np.array(tilts)[:4, :2], rel=0.06, abs=0.1)
    focal_ratio = coverage.distances_mm[0] / 600.0  # the focal length is a first guess
    assert focal_ratio == pytest.approx(1.0, abs=0.06)
    distances_mm = focal_ratio * np.array([600.0, 620.0, 640.0, 660.0, 680.0])
    assert coverage.distances_mm == pytest.approx(distances_mm, rel=2e-3)


def test_nothing_seen_covers_nothing():
    lost = TargetError("", reason="clipped")
    coverage = coverage_of([replace(seen(0), by_view=(lost, lost))], BOARD, 2)
    assert coverage.cells.sum() == coverage.shared.sum() == 0
    assert coverage.tilts_deg.shape == (0, 2)
    assert coverage.distances_mm.shape == (0,)
    assert coverage_text(coverage, NAMES) == "area left 0%, right 0%; pairs left-right 0"


def test_the_coverage_is_told_in_one_line():
    assert coverage_text(GOOD, NAMES) == (
        "area left 100%, right 100%; pairs left-right 6; tilt about x -15..+15, about y -15..+15 "
        "deg; distance 500..701 mm"
    )
    three = replace(
        GOOD, cells=np.ones((3, ROWS, COLUMNS), np.intp), shared=np.arange(9).reshape(3, 3)
    )
    assert "; pairs a-b 1, a-c 2, b-c 5; " in coverage_text(three, ("a", "b", "c"))


def told(**changes: np.ndarray) -> str:
    """The advice for what is just covered but for these."""
    advice = advise(replace(GOOD, **changes), NAMES, 0)
    assert advice.covered == advice.text.startswith("good coverage")
    return advice.text


def test_what_is_just_covered_is_covered():
    assert told() == "good coverage: go on with other places and tilts"
    nowhere = {"tilts_deg": np.empty((0, 2)), "distances_mm": np.empty(0)}
    assert told(**nowhere).startswith("good coverage")


def test_the_view_that_shares_least_with_the_reference_is_named():
    shared = np.array([[9, 5, 6], [5, 9, 0], [6, 0, 9]])
    three = replace(GOOD, shared=shared, cells=np.ones((3, ROWS, COLUMNS), np.intp))
    assert advise(three, ("a", "b", "c"), 0).text == (
        "show the target where a and b both see it (5 pictures so far)"
    )
    assert advise(three, ("a", "b", "c"), 2).text.startswith("show the target where c and b both")


@pytest.mark.parametrize(
    ("lacking", "way"),
    [
        (2, "turn its left side, as the camera sees it, away"),
        (3, "turn its right side, as the camera sees it, away"),
        (0, "tilt its lower side away"),
        (1, "tilt its upper side away"),
    ],
)
def test_each_way_of_tilting_is_asked_for(lacking: int, way: str):
    tilts_deg = GOOD.tilts_deg.copy()
    tilts_deg[lacking] *= 14.9 / 15.0
    assert told(tilts_deg=tilts_deg) == f"{way} from the camera by about 30 deg"


@pytest.mark.parametrize(
    ("tilt_deg", "next_way"),
    [((0, 25, 0), "right"), ((0, -25, 0), "left"), ((25, 0, 0), "upper"), ((-25, 0, 0), "lower")],
)
def test_the_side_that_was_away_is_not_asked_for_again(
    tilt_deg: tuple[float, float, float], next_way: str
):
    """A board's left side is farther where it was turned by more than nothing about y."""
    across = [(30, 0, 0), (-30, 0, 0)] if tilt_deg[1] else [(0, 30, 0), (0, -30, 0)]
    tilts = [tilt_deg, tilt_deg, *across] * 3
    boards = [seen(n, tilt_deg=tilt) for n, tilt in enumerate(tilts)]
    assert next_way in advise(coverage_of(boards, BOARD, 2), NAMES, 0).text


def test_distances_must_differ_by_more_than_two_fifths():
    assert told(distances_mm=np.array([500.0, 700.0])) == "bring it nearer, to about 389 mm"
    assert told(distances_mm=np.array([900.0])) == "bring it nearer, to about 500 mm"


@pytest.mark.parametrize(
    ("empty", "place"),
    [
        ((0, 0), "top left"),
        ((0, 2), "top middle"),
        ((3, 4), "bottom right"),
        ((2, 0), "bottom left"),
        ((1, 4), "top right"),
    ],
)
def test_the_empty_part_farthest_from_the_middle_is_asked_for(empty: tuple[int, int], place: str):
    cells = np.ones((2, ROWS, COLUMNS), np.intp)
    cells[1, 1:3, 1:3] = 0
    cells[1, 1, 3] = 0
    assert cells[1].mean() == 0.75
    assert told(cells=cells).startswith("good coverage")
    cells[1][empty] = 0
    assert told(cells=cells) == (
        f"show it in the {place} of the picture of right (70% of its area so far)"
    )


def test_motion_is_the_rms_of_the_view_that_moved_most():
    one = seen(0)
    assert motion_px(one, moved(one, (3.0, 4.0))) == pytest.approx(5.0)
    left, right = one.by_view
    assert isinstance(left, Detection)
    assert isinstance(right, Detection)
    xy_px = right.xy_px.copy()
    xy_px[0] += (6.0, 8.0)
    other = replace(one, by_view=(left, replace(right, xy_px=xy_px)))
    assert motion_px(one, other) == pytest.approx(10.0 / np.sqrt(len(xy_px)))


def test_only_corners_that_both_pictures_show_have_moved():
    one = seen(0)
    left = one.by_view[0]
    assert isinstance(left, Detection)

    def part(corners: slice, *, shift_px: float = 0.0, renamed: int = 0) -> PictureSightings:
        xy_px = left.xy_px[corners] + (shift_px, 0.0)
        found = Detection(left.ids[corners] + renamed, xy_px, left.sigma_px[corners], 0.9, 150.0)
        return replace(one, by_view=(found, TargetError("", reason="x")))

    first, last = part(slice(0, 30)), part(slice(20, 54), shift_px=1.0)
    assert motion_px(first, last) == pytest.approx(1.0)
    assert motion_px(first, part(slice(20, 54), renamed=100)) == float("inf")
