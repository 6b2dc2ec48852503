"""Gaps, bad data and epipolar distances of solves that are written down, not solved."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.geometry.bundle import coverage, suspicion, verdict
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.epipolar import epipolar_error
from rig.geometry.bundle.linearise import Target
from rig.geometry.bundle.motion import Motion
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.result import DepthError, Residuals
from rig.geometry.bundle.scatter import Scatter
from rig.geometry.bundle.settle import Problem
from rig.geometry.bundle.suspicion import swapped_layout, wrong_square
from rig.geometry.bundle.unknowns import Free, StageLine, Unknowns, lay_out
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry
from tests.support.calibration_scene import turn

TARGET = Target(np.array([[x, y, 0.0] for y in (0.0, 30.0) for x in (0.0, 40.0)]))
CAMERA = CameraModel(400, 200, 300.0, 300.0, 199.5, 99.5)


def geometry(*centres_mm: tuple[float, float]) -> RigGeometry:
    names = ("left", "middle", "right", "low")[: len(centres_mm)]
    poses = tuple(Pose(np.eye(3), np.array([-x, -y, 0.0])) for x, y in centres_mm)
    return RigGeometry(names, 0, (CAMERA,) * len(names), poses)


PAIR = geometry((0.0, 0.0), (40.0, 0.0))


def adjusted(
    *,
    tilts_deg: list[float] | None = None,
    middles_mm: list[float] | None = None,
    shown: list[tuple[int, int]] | None = None,
    xy_px: Float | None = None,
    weight: Float | None = None,
) -> Adjusted:
    """Boards at tilts about y and depths of their middles; one sighting of each (picture, view)."""
    middles_mm = middles_mm or [500.0] * len(tilts_deg or [0.0])
    tilts_deg = tilts_deg or [0.0] * len(middles_mm)
    shown = shown or [(0, 0)]
    points = 1 if xy_px is None else len(xy_px) // len(shown)
    rotations = np.stack([turn((0.0, tilt, 0.0)) for tilt in tilts_deg])
    shifts = np.array([[0.0, 0.0, z] for z in middles_mm]) - rotations @ [20.0, 15.0, 0.0]
    count = points * len(shown)
    observed = Observations(
        pictures=tuple(range(10, 10 + max(len(tilts_deg), 1 + max(p for p, _ in shown)))),
        start=points * np.arange(len(shown) + 1),
        picture=np.array([p for p, _ in shown]),
        view=np.array([v for _, v in shown]),
        ids=np.zeros(count, np.int64),
        xy_px=np.zeros((count, 2)) if xy_px is None else xy_px,
        sigma_px=np.ones(count),
    )
    at = Unknowns(
        ("none", "none"), (np.ones(4), np.ones(4)), np.stack([np.eye(3)] * 2), np.zeros((2, 3)),
        np.zeros(3), rotations, shifts,
    )  # fmt: skip
    problem = Problem(observed, TARGET, lay_out(at.lenses, 0, Free(), stage=False), None)
    ones = np.ones(count)
    scatter = Scatter(np.zeros(2), np.ones(2), np.ones(len(shown)), ones, ones)
    return Adjusted(problem, at, np.zeros((count, 2)), scatter, ones if weight is None else weight)


@pytest.mark.parametrize(("steepest_deg", "is_said"), [(14.9, True), (15.1, False)])
def test_one_of_ten_boards_is_tilted_by_fifteen_degrees(steepest_deg: float, is_said: bool) -> None:
    tilts = [0.0] * 9 + [steepest_deg, -steepest_deg]
    found = coverage._square_on(adjusted(tilts_deg=tilts))
    assert bool(found) is is_said
    staged = adjusted(tilts_deg=tilts)
    line = StageLine(np.eye(3), np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.0, 0.0)
    assert coverage._square_on(replace(staged, at=replace(staged.at, stage=line))) == []


def test_nine_of_ten_that_are_square_on_are_told_with_their_tilt() -> None:
    (reason,) = coverage._square_on(adjusted(tilts_deg=[2.0] * 19 + [40.0]))
    assert "tilted by less than 2 degrees" in reason.text


@pytest.mark.parametrize(("far_mm", "is_said"), [(699.0, True), (701.0, False)])
def test_distances_reach_from_one_to_one_and_two_fifths(far_mm: float, is_said: bool) -> None:
    given = adjusted(middles_mm=[600.0, 500.0, far_mm], tilts_deg=[50.0, -50.0, 50.0])
    found = coverage._short_range(given)
    assert bool(found) is is_said
    if is_said:
        assert "between 500 and 699 mm; bring some nearer and some beyond 700 mm" in found[0].text


@pytest.mark.parametrize(("both", "is_said"), [(7, True), (8, False)])
def test_eight_pictures_are_shared_with_another_view(both: int, is_said: bool) -> None:
    shown = [(p, v) for p in range(both) for v in (0, 1)] + [(20 + p, 0) for p in range(5)]
    found = coverage._few_shared(adjusted(shown=shown), PAIR)
    assert bool(found) is is_said
    if is_said:
        assert "by left (7), middle (7);" in found[0].text
    alone = coverage._few_shared(adjusted(shown=[(0, 0)]), geometry((0.0, 0.0)))
    assert alone == []


def corners(share: float) -> Float:
    """Points at the four corners of the quarter inside the picture that is `share` away."""
    x, y = 400 * share, 200 * share
    return np.array([[x, y], [400 - x, y], [x, 200 - y], [400 - x, 200 - y]])


def test_boards_reach_into_the_quarter_at_each_corner() -> None:
    one = geometry((0.0, 0.0))
    assert coverage._empty_corners(adjusted(xy_px=corners(0.249)), one) == []
    (reason,) = coverage._empty_corners(adjusted(xy_px=corners(0.251)), one)
    assert "left (top left, top right, bottom left, bottom right)" in reason.text
    names = ("top left", "top right", "bottom left", "bottom right")
    for missing, name in enumerate(names):
        weight = np.ones(4)
        weight[missing] = 0.0
        (reason,) = coverage._empty_corners(adjusted(xy_px=corners(0.2), weight=weight), one)
        assert f"of left ({name}):" in reason.text
        # A point on the same side alone, or on the same row alone, is not in the corner.
        beside = corners(0.2)
        beside[missing] = (200.0, beside[missing, 1])
        assert coverage._empty_corners(adjusted(xy_px=beside), one)
        beside[missing] = (corners(0.2)[missing, 0], 100.0)
        assert coverage._empty_corners(adjusted(xy_px=beside), one)


def test_each_view_has_corners_of_its_own() -> None:
    both = adjusted(shown=[(0, 0), (0, 1)], xy_px=np.concatenate([corners(0.2), corners(0.3)]))
    (reason,) = coverage._empty_corners(both, PAIR)
    assert "corners of middle (top left" in reason.text


@pytest.mark.parametrize(("left_out", "is_said"), [(2, False), (3, True)])
def test_two_of_a_hundred_points_may_be_left_out(left_out: int, is_said: bool) -> None:
    weight = np.ones(100)
    weight[:left_out] = 0.0
    found = verdict._outliers(adjusted(xy_px=np.zeros((100, 2)), weight=weight))
    assert [reason.text[:5] for reason in found] == (["3.0 %"] if is_said else [])


@pytest.mark.parametrize(("pct", "is_said"), [(0.2, False), (0.21, True), (np.nan, False)])
def test_depth_is_judged_at_a_metre(pct: float, is_said: bool) -> None:
    errors = [DepthError(500.0, 9.0, 9.0, 9.0), DepthError(1000.0, pct, 9.0, 9.0)]
    found = verdict._depth(errors)
    assert ["depth at 1 m is only known to 0.21 %" in r.text for r in found] == [True] * is_said
    assert verdict._depth(errors[:1]) == []


def test_notes_tell_what_cannot_be_judged_and_how_the_board_moved() -> None:
    assert len(verdict._notes(PAIR, None)) == 2
    assert len(verdict._notes(PAIR, np.zeros((2, 2)))) == 1
    assert verdict._notes(geometry((0.0, 0.0)), None) == []  # of one view no length is told
    assert verdict._motion(None) == []
    motion = Motion(np.array([np.radians(0.5), 0.25]), np.array([0.5, 3.0, 1.0]), 7.0)
    (note,) = verdict._motion(motion)
    assert "by 0.25 mm and 0.5 deg (1 sigma; 3.0 times that in the worst)" in note


STEPS = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]])


def test_places_that_fit_the_other_way_round_name_both_views() -> None:
    right = geometry((0.0, 0.0), (40.0, 0.0), (80.0, 0.0), (0.0, 40.0))
    assert swapped_layout(right, STEPS) == []
    wrong = geometry((0.0, 0.0), (40.0, 0.0), (0.0, 40.0), (80.0, 0.0))
    (reason,) = swapped_layout(wrong, STEPS)
    assert reason.text.startswith("right and low are swapped")
    # The reference exchanged with the second: all places are seen from there.
    moved = geometry((0.0, 0.0), (-40.0, 0.0), (40.0, 0.0), (-40.0, 40.0))
    (reason,) = swapped_layout(moved, STEPS)
    assert reason.text.startswith("left and middle are swapped")
    assert suspicion._likeness(np.zeros((2, 2)), STEPS[:2]) == 1.0
    assert suspicion._likeness(40 * STEPS, STEPS) == pytest.approx(1.0)
    assert suspicion._likeness(-STEPS, STEPS) == pytest.approx(-1.0)


def staged(scale: float, sigma: float = 1e-5) -> RigGeometry:
    covariance = np.diag([9.0, 9.0, sigma**2, 9.0])
    stage = StageGeometry(np.array([0.0, 0.0, 1.0]), scale, 0.0, covariance)
    return replace(PAIR, stage=stage)


def test_squares_may_differ_from_the_stage_by_half_a_per_cent_or_five_sigmas() -> None:
    assert wrong_square(PAIR) == []
    for scale in (1.0, 1.0049, 0.9951):
        assert wrong_square(staged(scale)) == []
    assert wrong_square(staged(1.019, sigma=0.004)) == []
    assert len(wrong_square(staged(1.021, sigma=0.004))) == 1
    (small,) = wrong_square(staged(1 / 0.98, sigma=0.001))
    assert "98.00 +- 0.20 % of the size given: the board was printed at 98.0 %" in small.text
    for scale in (0.9949, 1 / 0.89):
        (reason,) = wrong_square(staged(scale))
        assert "the square is wrong" in reason.text


def test_pictures_are_listed_up_to_eight() -> None:
    given = adjusted(tilts_deg=[0.0] * 12)
    assert suspicion._listed(given, [3]) == "picture 13"
    assert suspicion._listed(given, [0, 2]) == "pictures 10, 12"
    eight = "pictures 10, 11, 12, 13, 14, 15, 16, 17"
    assert suspicion._listed(given, list(range(8))) == eight
    assert suspicion._listed(given, list(range(10))) == f"{eight} and 2 more"


def residuals(picture: int, view: int, xy_px: list[list[float]], outlier: list[bool]) -> Residuals:
    count = len(xy_px)
    none = np.zeros((count, 2))
    return Residuals(
        picture, view, np.arange(count), np.array(xy_px), none, np.ones(count),
        np.array(outlier), none,
    )  # fmt: skip


def test_epipolar_lines_of_a_row_of_cameras_are_rows() -> None:
    """Beside each other, so that a point's line is its row: distances are those of rows."""
    first = [[100.0, 50.0], [200.0, 60.0], [300.0, 70.0], [50.0, 80.0]]
    second = [[90.0, 50.5], [180.0, 60.0], [270.0, 72.0], [40.0, 90.0]]
    none = [False] * 4
    found = epipolar_error(PAIR, [residuals(3, 0, first, none), residuals(3, 1, second, none)])
    assert found.mean_px == pytest.approx((0.5 + 0.0 + 2.0 + 10.0) / 4)
    assert found.max_px == pytest.approx(10.0)
    for here, there in (([False] * 3 + [True], none), (none, [False] * 3 + [True])):
        kept = epipolar_error(PAIR, [residuals(3, 0, first, here), residuals(3, 1, second, there)])
        assert kept.mean_px == pytest.approx(2.5 / 3)
        assert kept.max_px == pytest.approx(2.0)
    apart = epipolar_error(PAIR, [residuals(3, 0, first, none), residuals(4, 1, second, none)])
    assert np.isnan(apart.mean_px)
    gone = [True] * 4
    assert np.isnan(
        epipolar_error(PAIR, [residuals(3, 0, first, gone), residuals(3, 1, second, none)]).max_px
    )


def test_epipolar_distances_are_pixels_of_the_mean_focal_length() -> None:
    camera = CameraModel(400, 200, 200.0, 400.0, 200.0, 100.0)
    rig = replace(PAIR, cameras=(camera, camera))
    given = [residuals(0, v, [[100.0, y]], [False]) for v, y in ((0, 50.0), (1, 54.0))]
    # 4 px of 400 are a hundredth in a ray; of a mean focal length of 300 that is 3 px.
    assert epipolar_error(rig, given).max_px == pytest.approx(3.0)
