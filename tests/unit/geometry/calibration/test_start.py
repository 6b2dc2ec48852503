"""First guesses of cameras, views and boards, and the scores of lenses, from exact data."""

import numpy as np
import pytest

from rig.geometry.bundle.lens_choice import choose_lens, score_lenses
from rig.geometry.bundle.result import LensScore
from rig.geometry.bundle.start_cameras import (
    BoardPoints,
    bare_camera,
    board_misfit,
    board_pose,
    guess_camera,
)
from rig.geometry.bundle.start_places import place_boards, place_views
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from tests.support.calibration_scene import turn

PLANE_MM = np.array([[25.0 * c, 25.0 * r] for r in range(4) for c in range(6)])
SIZE_PX = (640, 400)


def pose(turned_deg: tuple[float, float, float], shift_mm: tuple[float, float, float]) -> Pose:
    return Pose(turn(turned_deg), np.array(shift_mm))


def board(camera: CameraModel, at: Pose) -> BoardPoints:
    points = np.concatenate([PLANE_MM, np.zeros((24, 1))], axis=1)
    return BoardPoints(PLANE_MM, camera.project(at.apply(points)))


POSES = [
    pose((20.0, 10.0, 5.0), (-60.0, -40.0, 500.0)),
    pose((-15.0, 25.0, -40.0), (-50.0, -20.0, 600.0)),
    pose((5.0, -30.0, 80.0), (20.0, -60.0, 450.0)),
]


def test_a_bare_camera_looks_through_the_middle_of_its_picture() -> None:
    camera = bare_camera(SIZE_PX, 500.0, "brown5")
    assert camera == CameraModel(640, 400, 500.0, 500.0, 319.5, 199.5, "brown5", (0.0,) * 5)


@pytest.mark.parametrize("at", POSES)
def test_a_pose_comes_back_from_the_pixels_of_its_board(at: Pose) -> None:
    camera = CameraModel(*SIZE_PX, 520.0, 530.0, 310.0, 205.0)
    seen = board(camera, at)
    found = board_pose(camera, seen)
    assert found is not None
    assert found.rotation == pytest.approx(at.rotation, abs=1e-6)
    assert found.translation_mm == pytest.approx(at.translation_mm, rel=1e-6)
    assert board_misfit(camera, seen, found) < 1e-4
    beside = BoardPoints(PLANE_MM, seen.xy_px + np.array([3.0, 4.0]))
    assert board_misfit(camera, beside, at) == pytest.approx(5.0, abs=1e-9)
    assert board_misfit(camera, seen, None) == np.inf
    behind = Pose(at.rotation, -at.translation_mm)
    assert board_misfit(camera, seen, behind) == np.inf


def test_fewer_than_four_points_give_no_pose() -> None:
    camera = CameraModel(*SIZE_PX, 520.0, 530.0, 310.0, 205.0)
    seen = board(camera, POSES[0])
    some = [0, 5, 18, 23]
    assert board_pose(camera, BoardPoints(PLANE_MM[some], seen.xy_px[some])) is not None
    assert board_pose(camera, BoardPoints(PLANE_MM[:3], seen.xy_px[:3])) is None


@pytest.mark.parametrize("step", [2, 4, 6])
@pytest.mark.parametrize("lens", ["none", "fisheye"])
def test_a_focal_length_of_the_scan_is_found_exactly(step: int, lens: LensModel) -> None:
    focal_px = 640.0 * 0.25 * 20.0 ** (step / 10)
    camera = bare_camera(SIZE_PX, focal_px, lens)
    found = guess_camera([board(camera, at) for at in POSES], SIZE_PX, lens)
    assert found.camera.fx_px == pytest.approx(focal_px, rel=1e-9)
    assert found.misfit_px < 1e-4


CAMERAS = (CameraModel(*SIZE_PX, 500.0, 500.0, 319.5, 199.5),) * 3
PLACES = [
    Pose.identity(),
    pose((0.0, 5.0, 0.0), (-60.0, 0.0, 3.0)),
    pose((4.0, 0.0, 2.0), (0.0, -50.0, -2.0)),
]


def views() -> dict[tuple[int, int], Pose]:
    """cam_from_board of three pictures in three views."""
    return {(p, v): PLACES[v] @ POSES[p] for p in range(3) for v in range(3)}


def test_views_are_placed_along_a_tree_whatever_one_picture_says() -> None:
    poses = views()
    poses[1, 1] = pose((10.0, 0.0, 0.0), (5.0, 5.0, 0.0)) @ poses[1, 1]
    found = place_views(poses, [(0, 1), (1, 2)], 3)
    for place, true in zip(found[:2], PLACES[:2], strict=True):
        assert place.rotation == pytest.approx(true.rotation, abs=1e-12)
        assert place.translation_mm == pytest.approx(true.translation_mm, abs=1e-9)
    whole = place_views(views(), [(0, 2), (2, 1)], 3)
    assert whole[1].translation_mm == pytest.approx(PLACES[1].translation_mm, abs=1e-9)


def test_of_all_views_answers_the_board_that_fits_best_is_taken() -> None:
    poses = views()
    boards = {key: board(CAMERAS[key[1]], at) for key, at in poses.items()}
    poses[0, 1] = pose((0.0, 3.0, 0.0), (9.0, 0.0, 0.0)) @ poses[0, 1]
    poses[2, 0] = pose((0.0, 3.0, 0.0), (9.0, 0.0, 0.0)) @ poses[2, 0]
    found = place_boards(boards, poses, CAMERAS, PLACES)
    assert sorted(found) == [0, 1, 2]
    for picture, true in enumerate(POSES):
        assert found[picture].translation_mm == pytest.approx(true.translation_mm, abs=1e-9)
        assert found[picture].rotation == pytest.approx(true.rotation, abs=1e-12)


def test_scores_are_medians_of_differences_with_their_standard_error() -> None:
    best = np.array([4.0, 1.0, 9.0, np.nan, 16.0])
    worse = best + np.array([1.0, 3.0, 2.0, 5.0, 8.0])
    first, second = score_lenses([("brown5", worse), ("fisheye", best)])
    assert (first.rms_px, second.rms_px) == pytest.approx((8.0**0.5, 6.5**0.5))
    assert (first.worse_px2, second.worse_px2) == (2.5, 0.0)
    # Of 1, 3, 2 and 8 about 2.5: 1.5, 0.5, 0.5, 5.5.
    assert first.sem_px2 == pytest.approx(1.2533 * 1.4826 * 1.0 / 2)
    assert second.sem_px2 == 0.0


@pytest.mark.parametrize(
    ("worse_px2", "sem_px2", "chosen"),
    [
        (2.0, 1.0, "brown5"), (2.01, 1.0, "fisheye"), (0.01, 0.0, "brown5"),
        (0.0101, 0.0, "fisheye"),
    ],
)  # fmt: skip
def test_a_simpler_lens_may_be_worse_by_two_standard_errors_or_a_hundredth(
    worse_px2: float, sem_px2: float, chosen: LensModel
) -> None:
    scores: list[LensScore] = [
        LensScore("brown5", 2.0, worse_px2, sem_px2),
        LensScore("fisheye", 1.0, 0.0, 0.0),
        LensScore("brown8", 1.5, 0.0, 0.0),
    ]
    assert choose_lens(scores) == chosen


def test_pictures_that_one_of_two_views_missed_do_not_place_them() -> None:
    poses = views()
    del poses[0, 1], poses[1, 0]
    found = place_views(poses, [(0, 1), (1, 2)], 3)
    for place, true in zip(found, PLACES, strict=True):
        assert place.translation_mm == pytest.approx(true.translation_mm, abs=1e-9)
