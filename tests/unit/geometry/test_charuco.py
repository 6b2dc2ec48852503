"""Corners of a ChArUco board against closed-form truth, and the reasons for having none."""

import sys
from functools import cache
from types import FrameType

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rig.errors import ConfigError, TargetError
from rig.targets import CharucoBoard, Target, find_target, full_corners
from rig.targets.charuco.board import DICTIONARIES, dictionary_bits
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.board_images import BoardScene, digitised
from tests.support.charuco_images import CharucoScene

BOARD = CharucoBoard(7, 5, 25.0, 18.75, "DICT_4X4_50")


def picture(scene: BoardScene, *, noise: float = 2.0, gain: float = 1.0) -> NDArray[np.uint8]:
    return digitised(scene.clean(), noise=noise, rng=np.random.default_rng(1), gain=gain)


def refusal(image: NDArray[np.uint8], board: Target = BOARD) -> TargetError:
    with pytest.raises(TargetError) as refused:
        find_target(image, board)
    return refused.value


@pytest.mark.parametrize(
    "tilt_deg",
    [(0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (20.0, -25.0, 40.0), (-30.0, 10.0, 135.0), (0, 40, 180)],
)
def test_corners_lie_within_a_hundredth_of_a_pixel_under_their_own_numbers(
    tilt_deg: tuple[float, float, float],
):
    scene = CharucoScene(tilt_deg=tilt_deg, distance_mm=420.0, background_contrast=40.0)
    found = find_target(picture(scene), BOARD)
    assert found.ids.tolist() == list(range(24))
    error = found.xy_px - scene.corners().reshape(-1, 2)
    assert np.sqrt(np.mean(error**2)) < 0.01
    assert 0.75 < np.std(error / found.sigma_px[:, None]) < 1.3
    assert found.contrast == pytest.approx(150, rel=0.1)
    assert found.blur_px == pytest.approx(np.hypot(0.9, 12**-0.5), rel=0.15)


SIGMA_CASES = [
    (share, side_px, blur_px, noise)
    for share, side_px in ((0.6, 45.0), (0.75, 28.0), (0.9, 28.0), (0.9, 45.0))
    for blur_px in (0.6, 1.0, 1.5)
    for noise in (1.0, 5.0)
    if blur_px < 1.5 or side_px > 28.0
]
FAST_CASES = {(0.75, 28.0, 0.6, 1.0), (0.9, 28.0, 1.0, 1.0), (0.9, 45.0, 0.6, 1.0)}


@pytest.mark.parametrize(
    ("share", "side_px", "blur_px", "noise"),
    [
        pytest.param(*case, marks=() if case in FAST_CASES else pytest.mark.slow)
        for case in SIGMA_CASES
    ],
)
def test_errors_are_as_large_as_sigma_says_at_any_margin(
    share: float, side_px: float, blur_px: float, noise: float
):
    """Margins from 1.4 to 9 px, seen at a slant from as near as twenty squares."""
    board = BOARD.with_changes(marker_mm=25.0 * share)
    ratios: list[NDArray[np.float64]] = []
    for seed, tilt_deg in enumerate([(20.0, 25.0, 100.0), (0.0, 30.0, 10.0), (-25.0, 15.0, -60.0)]):
        scene = CharucoScene(
            width=400,
            height=340,
            distance_mm=560.0 * 25.0 / side_px,
            tilt_deg=tilt_deg,
            offset_mm=(0.3 * seed, 0.2 * seed),
            blur_px=blur_px,
            marker_share=share,
        )
        image = digitised(scene.clean(), noise=noise, rng=np.random.default_rng(seed))
        found = find_target(image, board)
        error = found.xy_px - scene.corners().reshape(-1, 2)[found.ids]
        ratios.append((error / found.sigma_px[:, None]).ravel())
    ratio = np.concatenate(ratios)
    assert len(ratio) > 130
    assert 0.75 < 1.4826 * np.median(np.abs(ratio)) < 1.3
    assert abs(np.mean(ratio)) < 0.3


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("rows", [3, 4])
def test_every_pattern_is_found_and_no_other_taken_for_it(inverted: bool, legacy: bool, rows: int):
    scene = CharucoScene(rows=rows, inverted=inverted, legacy_pattern=legacy, distance_mm=520.0)
    board = CharucoBoard(
        7, rows + 1, 25.0, 18.75, "4X4_50", inverted=inverted, legacy_pattern=legacy
    )
    found = find_target(picture(scene), board)
    assert found.xy_px == pytest.approx(scene.corners().reshape(-1, 2)[found.ids], abs=0.06)
    assert len(found) == 6 * rows
    error = refusal(picture(scene), board.with_changes(inverted=not inverted))
    assert error.reason == "wrong-pattern"
    assert f"inverted = {str(inverted).lower()}" in str(error)
    if rows % 2:  # even number of squares down
        error = refusal(picture(scene), board.with_changes(legacy_pattern=not legacy))
        assert f"legacy_pattern = {str(legacy).lower()}" in str(error)


def test_a_part_of_the_board_is_enough():
    scene = CharucoScene(distance_mm=330.0, offset_mm=(-170.0, 60.0), tilt_deg=(10.0, 20.0, 5.0))
    truth = scene.corners().reshape(-1, 2)
    inside = ((truth > 8) & (truth < [631, 391])).all(axis=1)
    found = find_target(picture(scene), BOARD)
    assert 6 <= inside.sum() < 20
    assert set(np.flatnonzero(inside)) <= set(found.ids.tolist())
    assert found.xy_px == pytest.approx(truth[found.ids], abs=0.06)
    with pytest.raises(TargetError) as refused:
        full_corners(picture(scene), BOARD)
    assert refused.value.reason == "clipped"


def test_a_hand_over_the_board_costs_only_the_corners_under_it():
    scene = CharucoScene(distance_mm=450.0)
    image = picture(scene)
    truth = scene.corners().reshape(-1, 2)
    x, y = np.round(truth[9]).astype(int)
    image[y - 30 : y + 30, x - 30 : x + 30] = 120
    covered = np.abs(truth - (x, y)).max(axis=1) < 36
    found = find_target(image, BOARD)
    assert set(np.flatnonzero(~covered)) <= set(found.ids.tolist())
    assert 9 not in found.ids


def test_all_corners_make_a_grid_as_of_a_checkerboard():
    scene = CharucoScene(distance_mm=520.0, tilt_deg=(5.0, 10.0, 15.0))
    corners = full_corners(picture(scene), BOARD)
    assert corners.board == Checkerboard(6, 4, 25.0)
    assert corners.xy_px == pytest.approx(scene.corners(), abs=0.06)


def test_one_door_finds_a_checkerboard_too():
    image = picture(BoardScene(tilt_deg=(10.0, 15.0, 20.0)))
    board = Checkerboard(9, 6, 25.0)
    found, corners = find_target(image, board), find_corners(image, board)
    assert found.ids.tolist() == list(range(54))
    assert np.array_equal(found.xy_px, corners.xy_px.reshape(-1, 2))
    assert np.array_equal(full_corners(image, board).xy_px, corners.xy_px)


def test_another_dictionary_is_named():
    error = refusal(picture(CharucoScene()), BOARD.with_changes(dictionary="5X5_100"))
    assert error.reason == "wrong-dictionary"
    assert "4X4_1000" in str(error)


def test_another_size_is_named():
    asked = BOARD.with_changes(squares_across=5, squares_down=7)
    error = refusal(picture(CharucoScene()), asked)
    assert error.reason == "wrong-count"
    assert "7 squares across" in str(error)


def test_a_board_without_markers_is_told_apart():
    error = refusal(picture(BoardScene(columns=6, rows=4)))
    assert error.reason == "not-found"
    assert "24 corners" in str(error)
    assert "checkerboard" in str(error)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"distance_mm": 1500.0, "blur_px": 0.5}, "too-small"),
        ({"distance_mm": 520.0, "blur_px": 5.0}, "blurred"),
    ],
)
def test_small_and_blurred_boards_are_named(changes: dict[str, object], reason: str):
    assert refusal(picture(CharucoScene().with_changes(**changes))).reason == reason


def test_a_few_corners_are_counted():
    scene = CharucoScene(distance_mm=400.0)
    x, y = np.round(scene.corners()[0, 0]).astype(int)
    side = round(25 * 560 / 400)
    image = np.full((400, 640), 110, np.uint8)
    part = np.s_[y - side : y + 2 * side - 6, x - side : x + 2 * side - 6]
    image[part] = picture(scene)[part]
    error = refusal(image)
    assert error.reason == "few-corners"
    assert "6 are needed" in str(error)


def test_exposure_is_blamed_where_it_is_to_blame():
    assert refusal(picture(CharucoScene(), gain=8.0)).reason == "over-exposed"
    assert refusal(picture(CharucoScene(), gain=0.01)).reason == "under-exposed"


def test_nan_and_slivers_are_refused():
    for image in (np.full((40, 40), np.nan, np.float32), np.zeros((4, 400), np.uint8)):
        with pytest.raises(TargetError, match="finite pixels"):
            find_target(image, BOARD)


@pytest.mark.parametrize(
    "wrong",
    [
        {"squares_across": 2},
        {"squares_across": 3, "squares_down": 3},
        {"marker_mm": 25.0},
        {"marker_mm": 0.0},
        {"dictionary": "4X4_51"},
        {"squares_across": 11, "squares_down": 10},
    ],
)
def test_impossible_boards_are_refused(wrong: dict[str, object]):
    with pytest.raises(ConfigError):
        BOARD.with_changes(**wrong)


@pytest.mark.parametrize("name", DICTIONARIES)
def test_boards_and_bits_are_those_of_opencv(name: str):
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[name])
    bits = dictionary_bits(name)
    drawn = dictionary.generateImageMarker(3, bits.shape[1] + 2)
    assert np.array_equal(drawn[1:-1, 1:-1] > 0, bits[3])
    for legacy in (False, True):
        for size in ((4, 5), (5, 4), (4, 4), (5, 5)):
            ours = CharucoBoard(*size, 1.0, 0.75, name, legacy_pattern=legacy)
            theirs = cv2.aruco.CharucoBoard(size, 1.0, 0.75, dictionary)
            theirs.setLegacyPattern(legacy)
            assert ours.marker_count == len(np.asarray(theirs.getIds()))
            corners = np.asarray(theirs.getChessboardCorners()) - (1.0, 1.0, 0.0)
            assert ours.points_mm.reshape(-1, 3) == pytest.approx(corners, abs=1e-6)
            where = np.argwhere(ours.white)[:, ::-1] + 0.125
            first = np.array([points[0][:2] for points in theirs.getObjPoints()])
            assert where == pytest.approx(first, abs=1e-6)


@pytest.mark.slow
@given(
    period=st.integers(5, 60),
    fill=st.floats(0.2, 0.8),
    blur=st.floats(0.0, 2.0),
    noise=st.floats(0.0, 80.0),
    kind=st.sampled_from(["squares", "chess", "lines", "noise"]),
    seed=st.integers(0, 99),
)
@settings(max_examples=25, deadline=None)
def test_no_picture_makes_much_work(
    period: int, fill: float, blur: float, noise: float, kind: str, seed: int
):
    y, x = np.mgrid[:240, :320]
    clean = {
        "squares": (x % period < fill * period) & (y % period < fill * period),
        "chess": (x // period + y // period) % 2 == 0,
        "lines": x % period < fill * period,
        "noise": np.zeros(x.shape),
    }[kind]
    sharp = clean.astype(np.float32) * 180
    rng = np.random.default_rng(seed)
    smooth = cv2.GaussianBlur(sharp, (0, 0), blur) if blur > 0.1 else sharp
    image = np.clip(smooth + rng.normal(20, noise + 1e-3, x.shape), 0, 255).astype(np.uint8)
    _load_loops()
    for target in (BOARD, Checkerboard(9, 6, 25.0)):
        assert _calls(image, target) < 60_000


@cache
def _load_loops() -> None:
    """The first search of a program loads, or compiles, what it runs: that is no work."""
    for target in (BOARD, BOARD.as_checkerboard):
        find_target(
            picture(CharucoScene() if target is BOARD else BoardScene(columns=6, rows=4)), target
        )


def _calls(image: NDArray[np.uint8], target: Target) -> int:
    """Function calls that a search makes: as good as a time, and the same on every machine."""
    count = 0

    def tick(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal count
        count += event.endswith("call")

    before = sys.getprofile()
    sys.setprofile(tick)
    try:
        find_target(image, target)
    except TargetError:
        pass
    finally:
        sys.setprofile(before)
    return count
