"""AprilGrids: layout by closed form, corners against rendered truth, and reasons for refusals."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rig.arrays import Float
from rig.errors import ConfigError, TargetError
from rig.targets import AprilGrid, Detection, find_target, full_corners
from rig.targets.aprilgrid import corner_grid
from rig.targets.aprilgrid.board import tag_bits
from rig.targets.aprilgrid.tags import homographies
from rig.targets.printing.april_areas import april_size_mm
from tests.support.april_images import AprilScene
from tests.support.board_images import digitised

SCENE = AprilScene(tag_columns=3, tag_rows=2, width=320, height=240, focal_px=520.0)
GRID = AprilGrid(3, 2, 30.0, 0.3)


def picture(scene: AprilScene, seed: int = 1) -> np.ndarray:
    return digitised(scene.clean(), noise=2.0, rng=np.random.default_rng(seed))


def refused(image: np.ndarray, grid: AprilGrid) -> TargetError:
    with pytest.raises(TargetError) as told:
        find_target(image, grid)
    return told.value


def off_px(found: Detection, scene: AprilScene) -> Float:
    return found.xy_px - scene.corners().reshape(-1, 2)[found.ids]


@pytest.fixture(scope="module")
def tilted() -> tuple[AprilScene, np.ndarray]:
    scene = SCENE.with_changes(tilt_deg=(25.0, -20.0, 12.0))
    return scene, picture(scene)


def test_points_run_from_the_top_left_and_tags_from_the_bottom_left():
    points = GRID.points_mm
    assert points.shape == (4, 6, 3)
    assert points[0, :, 0].tolist() == pytest.approx([0, 30, 39, 69, 78, 108])
    assert points[:, 0, 1].tolist() == pytest.approx([0, 30, 39, 69])
    assert not points[..., 2].any()
    assert GRID.tag_numbers.tolist() == [[3, 4, 5], [0, 1, 2]]
    assert AprilGrid(2, 1, 30.0, 0.3, first_tag=40).tag_numbers.tolist() == [[40, 41]]
    assert GRID.clear_share == pytest.approx(0.2)
    assert AprilGrid(3, 2, 30.0, 0.3, border_bits=1).clear_share == pytest.approx(0.125)
    assert AprilGrid(3, 2, 30.0, 0.1).clear_share == pytest.approx(0.1)


def test_the_first_tag_is_the_one_that_kalibr_prints():
    # 0xd5d628584 row by row, the highest bit first, one is white.
    bits = [int(bit) for bit in f"{0xD5D628584:036b}"]
    assert tag_bits()[0].ravel().tolist() == [bool(bit) for bit in bits]


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ((1, 1, 30.0, 0.3), "at least two tags"),
        ((6, 6, 0.0, 0.3), "share of it"),
        ((6, 6, 30.0, 1.5), "share of it"),
        ((6, 6, 30.0, 0.3, 3), "Kalibr prints 2"),
        ((6, 6, 30.0, 0.3, 2, 560), "numbers 0..586"),
    ],
)
def test_a_grid_that_cannot_be_is_told(numbers: tuple[float, ...], told: str):
    with pytest.raises(ConfigError, match=told):
        AprilGrid(*numbers)  # pyright: ignore[reportArgumentType]


def test_all_corners_of_a_tilted_grid_are_found_to_a_fiftieth_of_a_pixel(
    tilted: tuple[AprilScene, np.ndarray],
):
    scene, image = tilted
    found = find_target(image, GRID)
    assert found.ids.tolist() == list(range(24))
    off = off_px(found, scene)
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert np.abs(off.mean(axis=0)).max() < 0.008
    assert 0.6 < np.std(off / found.sigma_px[:, None]) < 1.6
    assert found.blur_px == pytest.approx(0.85, abs=0.05)
    assert found.contrast == pytest.approx(150.0, abs=5.0)


def test_a_part_in_view_names_its_own_corners(tilted: tuple[AprilScene, np.ndarray]):
    scene, image = tilted
    cut = image[:, :180]
    found = find_target(np.ascontiguousarray(cut), GRID)
    assert 8 <= len(found) < 24
    assert np.abs(off_px(found, scene)).max() < 0.1
    assert (found.xy_px[:, 0] < 178).all()


def test_a_grid_upside_down_keeps_its_numbers():
    scene = SCENE.with_changes(tilt_deg=(0.0, 0.0, 170.0))
    found = find_target(picture(scene), GRID)
    assert found.ids.tolist() == list(range(24))
    assert np.abs(off_px(found, scene)).max() < 0.1


def test_a_covered_tag_costs_its_corners_and_no_others(tilted: tuple[AprilScene, np.ndarray]):
    scene, image = tilted
    covered = image.copy()
    corners = scene.corners()[0:2, 0:2].reshape(-1, 2)
    low, high = corners.min(axis=0).astype(int) - 3, corners.max(axis=0).astype(int) + 4
    covered[low[1] : high[1], low[0] : high[0]] = 110
    found = find_target(covered, GRID)
    missing = set(range(24)) - set(found.ids.tolist())
    assert {0, 1, 6, 7} <= missing
    assert missing <= {0, 1, 6, 7, 2, 8, 12, 13}  # the cover touches its neighbours
    assert np.abs(off_px(found, scene)).max() < 0.1


def test_tags_without_squares_between_them_have_no_crossings():
    error = refused(picture(SCENE.with_changes(squares=False)), GRID)
    assert error.reason == "few-corners"
    assert "6 are needed" in str(error)


def test_another_layout_is_told_by_its_numbers(tilted: tuple[AprilScene, np.ndarray]):
    error = refused(tilted[1], AprilGrid(3, 2, 30.0, 0.3, first_tag=100))
    assert error.reason == "wrong-count"
    assert "found tags 0, 1, 2, 3, 4, 5" in str(error)


def test_another_border_is_told(tilted: tuple[AprilScene, np.ndarray]):
    error = refused(tilted[1], AprilGrid(3, 2, 30.0, 0.3, border_bits=1))
    assert error.reason == "wrong-pattern"
    assert error.advice == "set border_bits = 2"


def test_another_spacing_is_told_with_what_it_is(tilted: tuple[AprilScene, np.ndarray]):
    error = refused(tilted[1], AprilGrid(3, 2, 30.0, 0.2))
    assert error.reason == "wrong-pattern"
    assert "0.2 of their side apart asked for, they are 0.30" in str(error)


def test_small_tags_and_blurred_ones_are_told():
    far = refused(picture(SCENE.with_changes(distance_mm=860.0)), GRID)
    assert far.reason == "too-small"
    assert "at least 2 px are needed" in str(far)
    blurred = refused(picture(SCENE.with_changes(blur_px=3.2)), GRID)
    assert blurred.reason == "blurred"
    assert "focus the lens" in str(blurred)


def test_darkness_and_pictures_without_tags_are_told():
    assert refused(np.full((120, 160), 3, np.uint8), GRID).reason == "under-exposed"
    assert refused(np.full((120, 160), 255, np.uint8), GRID).reason == "over-exposed"
    rng = np.random.default_rng(2)
    noise = rng.integers(0, 255, (240, 320)).astype(np.uint8)
    assert refused(noise, GRID).reason == "not-found"


def test_a_mirrored_picture_is_named(tilted: tuple[AprilScene, np.ndarray]):
    error = refused(np.ascontiguousarray(tilted[1][:, ::-1]), GRID)
    assert error.reason == "mirrored"
    assert "found 6 of its tags mirrored" in str(error)


def test_who_needs_squares_is_told_that_there_are_none(tilted: tuple[AprilScene, np.ndarray]):
    with pytest.raises(TargetError, match="target without squares") as told:
        full_corners(tilted[1], GRID)
    assert told.value.reason == "no-squares"


@given(arrays(np.uint8, st.tuples(st.integers(16, 60), st.integers(16, 60))))
@settings(max_examples=25, deadline=None)
def test_any_small_picture_is_refused_with_a_reason(image: np.ndarray):
    with pytest.raises(TargetError) as told:
        find_target(image, GRID)
    assert told.value.reason


def test_homographies_take_the_unit_square_to_quadrilaterals():
    quads = np.array([[[10.0, 20.0], [50.0, 25.0], [45.0, 70.0], [5.0, 55.0]]])
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], np.float32)
    wanted = cv2.getPerspectiveTransform(unit, quads[0].astype(np.float32))
    assert homographies(quads)[0] == pytest.approx(wanted, abs=1e-6)


def test_where_corners_are_expected_is_exact_for_any_tilt():
    tilted = np.array([[30.0, 2.0, 40.0], [-3.0, 28.0, 35.0], [0.02, -0.015, 1.0]])

    def mapped(places: Float) -> Float:
        xyw = np.concatenate([places, np.ones((len(places), 1))], axis=1) @ tilted.T
        return xyw[:, :2] / xyw[:, 2:]

    places = np.argwhere(np.ones((5, 6)))[:, ::-1].astype(np.float64)
    wanted = np.array([[2.3, 1.7], [0.0, 0.0], [4.5, 3.5]])
    start_px, along, side_px = corner_grid._expected(wanted, places, mapped(places))
    assert start_px == pytest.approx(mapped(wanted), abs=1e-6)
    step = 1e-6
    slopes = np.stack(
        [(mapped(wanted + step * axis) - mapped(wanted)) / step for axis in np.eye(2)], axis=1
    )
    length = np.linalg.norm(slopes, axis=2)
    assert along == pytest.approx(slopes / length[..., None], abs=1e-4)
    area = np.abs(np.linalg.det(slopes))
    assert side_px == pytest.approx(area / length.max(axis=1), rel=1e-4)


def test_the_size_of_a_printed_grid_has_the_outer_squares():
    # Tags of 30 mm, gaps of 9: three tags and four gaps, two tags and three gaps.
    assert april_size_mm(GRID) == pytest.approx((126.0, 87.0))
