"""Bad data and gaps are named, and a good set of pictures is called good."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import (
    HEIGHT,
    WIDTH,
    BoardPose,
    Scene,
    flat_board_mm,
    on_stage,
    random_scene,
)

NAMES = ("centre", "right", "low")
STEPS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
COUNT = 18
HALF = COUNT // 2
SCENE = random_scene(4, COUNT)
POSITIONS_MM = np.linspace(0.0, 500.0, 8)


def solve(sightings: list[Sighting], **options: object) -> Calibration:
    views = 1 + max(sighting.view for sighting in sightings)
    given = {"lens": "brown5", "steps": STEPS[:views], **options}
    sizes = [(WIDTH, HEIGHT)] * views
    return solve_rig(sightings, flat_board_mm(), sizes, NAMES[:views], 0, **given)  # pyright: ignore[reportArgumentType]


def said(found: Calibration, code: str) -> str:
    """Text of the one reason with this code."""
    (text,) = [reason.text for reason in found.verdict.reasons if reason.code == code]
    assert text in str(found.verdict)
    assert not found.verdict.good
    return text


def exchanged(sightings: list[Sighting], one: int, other: int, pictures: range) -> list[Sighting]:
    order = {one: other, other: one}
    return [
        replace(s, view=order.get(s.view, s.view)) if s.picture in pictures else s
        for s in sightings
    ]


def late(view: int, pictures: range) -> list[Sighting]:
    """One view shows the board where it was a moment earlier."""
    rng = np.random.default_rng(3)
    earlier = replace(
        SCENE,
        poses=tuple(
            BoardPose(
                tuple(np.add(pose.middle_mm, rng.normal(0, 3, 3))),
                tuple(np.add(pose.turned_deg, rng.normal(0, 0.4, 3))),
            )
            for pose in SCENE.poses
        ),
    )
    wrong = [s for s in earlier.sightings(1) if s.view == view and s.picture in pictures]
    right = [s for s in SCENE.sightings(1) if s.view != view or s.picture not in pictures]
    return right + wrong


def bumped(view: int) -> list[Sighting]:
    """One camera stands elsewhere from half-way on."""
    cameras = list(SCENE.cameras)
    camera = cameras[view]
    cameras[view] = replace(
        camera,
        centre_mm=tuple(np.add(camera.centre_mm, (0.5, 0.2, -0.3))),
        turned_deg=tuple(np.add(camera.turned_deg, (0.2, -0.1, 0.1))),
    )
    after = replace(SCENE, cameras=tuple(cameras)).sightings(1)
    before = SCENE.sightings(1)
    return [s for s in before if s.picture < HALF] + [s for s in after if s.picture >= HALF]


def staged(square_mm: float) -> tuple[list[Sighting], dict[int, float]]:
    axis = np.array([0.005, 0.003, 1.0])
    scene = on_stage(replace(SCENE, square_mm=square_mm), axis, POSITIONS_MM, 430.0)
    return scene.sightings(1), {COUNT + i: s for i, s in enumerate(POSITIONS_MM.tolist())}


@pytest.mark.slow
def test_a_good_set_is_called_good_with_what_cannot_be_judged():
    found = solve(SCENE.sightings(1))
    assert str(found.verdict) == "good"
    assert any("no stage took part" in note for note in found.verdict.notes)
    assert len(found.verdict.poses) == 3
    gains = [pose.gain_pct for pose in found.verdict.poses]
    assert gains == sorted(gains)
    assert 0 < gains[0] < gains[-1] < 100


@pytest.mark.slow
def test_two_views_exchanged_in_all_pictures_are_named():
    swapped = exchanged(SCENE.sightings(1), 0, 1, range(COUNT))
    assert "centre and right are swapped" in said(solve(swapped), "swapped")


@pytest.mark.slow
def test_without_the_places_of_the_profile_the_verdict_says_what_it_cannot_see():
    swapped = exchanged(SCENE.sightings(1), 0, 1, range(COUNT))
    found = solve(swapped, steps=None)
    assert found.verdict.good
    assert any("exchanged views cannot be noticed" in note for note in found.verdict.notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    "sightings",
    [
        exchanged(SCENE.sightings(1), 0, 1, range(3, 5)),
        pytest.param(
            [s for s in exchanged(SCENE.sightings(1), 0, 1, range(3, 5)) if s.view < 2],
            marks=pytest.mark.slow,
        ),
    ],
    ids=["three views", "two views"],
)
def test_two_views_exchanged_in_some_pictures_are_named(sightings: list[Sighting]):
    text = said(solve(sightings), "swapped")
    assert "centre and right are swapped in pictures 3, 4" in text


@pytest.mark.slow
@pytest.mark.parametrize("view", [0, 1])
def test_a_view_that_is_not_synchronised_is_named(view: int):
    text = said(solve(late(view, range(COUNT))), "unsynchronised")
    assert text.startswith(f"{NAMES[view]} is not synchronised")


@pytest.mark.slow
def test_pictures_in_which_the_board_moved_are_named():
    assert "views of pictures 5, 6" in said(solve(late(1, range(5, 7))), "moved")


@pytest.mark.slow
@pytest.mark.parametrize("view", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_a_camera_bumped_half_way_is_named_with_the_picture(view: int):
    text = said(solve(bumped(view)), "bumped")
    assert text.startswith(f"{NAMES[view]} was bumped: from picture {HALF} on")


@pytest.mark.slow
def test_of_two_views_either_may_have_been_bumped():
    text = said(solve([s for s in bumped(1) if s.view < 2]), "bumped")
    assert text.startswith(f"centre or right was bumped: from picture {HALF} on")


@pytest.mark.slow
def test_blurred_pictures_are_named_and_do_little_harm():
    found = solve(replace(SCENE, blurred={3: 5.0, 11: 5.0}).sightings(1))
    text = said(found, "blurred")
    assert text.startswith("pictures 3, 11 scatter")
    sharp = solve([s for s in SCENE.sightings(1) if s.picture not in (3, 11)])
    apart = found.geometry.centres_mm() - sharp.geometry.centres_mm()
    assert np.abs(apart).max() < 0.02


@pytest.mark.parametrize(
    ("square_mm", "says"),
    [
        (24.5, r"the squares have 98\.0\d .*printed at 98\.0 %"),
        pytest.param(
            30.0, r"the squares have 120\.\d+ .*the square is wrong", marks=pytest.mark.slow
        ),
    ],
)
def test_a_board_of_another_size_shows_against_the_stage(square_mm: float, says: str):
    sightings, stage_mm = staged(square_mm)
    assert re.search(says, said(solve(sightings, stage_mm=stage_mm), "square-size"))


@pytest.mark.slow
def test_a_true_board_on_the_stage_is_good():
    sightings, stage_mm = staged(25.0)
    assert str(solve(sightings, stage_mm=stage_mm).verdict) == "good"


def with_poses(change: Callable[[BoardPose], BoardPose]) -> Scene:
    return replace(SCENE, poses=tuple(map(change, SCENE.poses)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "code", "says"),
    [
        (
            with_poses(lambda p: replace(p, turned_deg=tuple(0.1 * t for t in p.turned_deg))),
            "square-on",
            "tilt the board by 20",
        ),
        (
            with_poses(lambda p: replace(p, middle_mm=(0.0, 20.0, max(p.middle_mm[2], 700.0)))),
            "corners",
            "centre (top left, top right, bottom left, bottom right)",
        ),
        (
            with_poses(
                lambda p: replace(p, middle_mm=(*p.middle_mm[:2], 600.0 + 0.1 * p.middle_mm[2]))
            ),
            "depth-range",
            "depth range too short: all boards are between",
        ),
        (replace(SCENE, poses=SCENE.poses[:6]), "few-pictures", "centre (6), right (6), low (6)"),
        (replace(SCENE, corner_px=0.6), "depth-error", "depth at 1 m is only known to"),
    ],
    ids=["square-on", "corners", "depth-range", "few-pictures", "depth-error"],
)
def test_what_the_pictures_left_out_is_named(scene: Scene, code: str, says: str):
    assert says in said(solve(scene.sightings(1)), code)


@pytest.mark.slow
def test_the_pose_that_is_advised_helps_as_much_as_is_said():
    found = solve(SCENE.sightings(1))
    advised = found.verdict.poses[0]
    camera = found.geometry.cameras[0]
    x, y = camera.unproject(np.array([advised.centre_px]))[0] * advised.distance_mm
    pose = BoardPose((float(x), float(y), advised.distance_mm), (*advised.tilt_deg, 0.0))
    better = solve(replace(SCENE, poses=(*SCENE.poses, pose)).sightings(1))

    def variance(calibration: Calibration) -> float:
        return sum(error.picture_pct**2 for error in calibration.depth_error)

    gain_pct = 100 * (1 - np.sqrt(variance(better) / variance(found)))
    assert gain_pct == pytest.approx(advised.gain_pct, abs=12)


@pytest.mark.slow
def test_a_model_that_fails_is_told_beside_corners_that_nobody_showed():
    """Focus breathes by 0.3 % from picture to picture, and no board was held in a corner."""
    scene = random_scene(44, 15)
    grow = 1.0 + np.random.default_rng(44).uniform(-0.003, 0.003, len(scene.poses))
    middles = [np.asarray(camera.middle_px) for camera in scene.cameras]
    breathing = [
        replace(s, xy_px=middles[s.view] + (s.xy_px - middles[s.view]) * grow[s.picture])
        for s in scene.sightings(1)
    ]
    codes = [reason.code for reason in solve(breathing).verdict.reasons]
    assert codes == ["model", "corners"]
