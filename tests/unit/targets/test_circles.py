"""Grids of circles: layout, centroids and their bias against closed forms, and refusals."""

from functools import cache

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rig.arrays import Float
from rig.errors import ConfigError, TargetError
from rig.geometry.camera_model import CameraModel
from rig.geometry.circle_bias import centre_bias_px, without_bias
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from rig.targets import CircleGrid, find_target
from rig.targets.circles.arrange import arrange
from tests.support.board_images import digitised
from tests.support.circle_images import CircleScene

SCENE = CircleScene(
    rows=5, spacing_mm=24.0, diameter_mm=20.0, width=320, height=240, focal_px=520.0
)
GRID = CircleGrid(4, 5, 24.0, 20.0)
TILTED = SCENE.with_changes(tilt_deg=(35.0, -30.0, 8.0))


@cache
def rendered(scene: CircleScene) -> np.ndarray:
    return digitised(scene.clean(), noise=2.0, rng=np.random.default_rng(1))


def picture(scene: CircleScene) -> np.ndarray:
    return rendered(scene).copy()


def refused(image: np.ndarray, grid: CircleGrid) -> TargetError:
    with pytest.raises(TargetError) as told:
        find_target(image, grid)
    return told.value


def pose_of(scene: CircleScene) -> Pose:
    rotation = np.asarray(cv2.Rodrigues(np.radians(np.array(scene.tilt_deg)))[0], np.float64)
    middle = scene.spacing_mm * np.array([scene.columns - 0.5, (scene.rows - 1) / 2])
    return Pose(
        rotation, np.array([*scene.offset_mm, scene.distance_mm]) - rotation[:, :2] @ middle
    )


def camera_of(scene: CircleScene) -> CameraModel:
    middle = (scene.width - 1) / 2, (scene.height - 1) / 2
    return CameraModel(scene.width, scene.height, scene.focal_px, scene.focal_px, *middle)


def test_rows_are_shifted_in_turn_as_in_opencv():
    points = GRID.points_mm
    assert points.shape == (5, 4, 3)
    assert points[0, :, 0].tolist() == [0.0, 48.0, 96.0, 144.0]
    assert points[1, :, 0].tolist() == [24.0, 72.0, 120.0, 168.0]
    assert points[:, 0, 1].tolist() == [0.0, 24.0, 48.0, 72.0, 96.0]
    assert GRID.gap_mm == pytest.approx(24.0 * 2**0.5 - 20.0)
    assert GRID.has_one_way_up
    assert not CircleGrid(4, 6, 24.0, 20.0).has_one_way_up


@pytest.mark.parametrize(
    ("numbers", "told"),
    [((1, 5, 24.0, 20.0), "2 x 3"), ((4, 5, 24.0, 34.0), "33.9"), ((4, 5, 24.0, 0.0), "not touch")],
)
def test_a_grid_that_cannot_be_is_told(numbers: tuple[float, ...], told: str):
    with pytest.raises(ConfigError, match=told):
        CircleGrid(*numbers)  # pyright: ignore[reportArgumentType]


def test_middles_of_ellipses_are_found_to_a_fiftieth_of_a_pixel():
    found = find_target(picture(TILTED), GRID)
    assert found.ids.tolist() == list(range(20))
    off = found.xy_px - TILTED.middles()
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert np.abs(off.mean(axis=0)).max() < 0.01
    assert 0.6 < np.std(off / found.sigma_px[:, None]) < 1.6
    assert found.blur_px == pytest.approx(0.85, abs=0.1)
    assert found.contrast == pytest.approx(150.0, abs=6.0)


def test_shading_does_not_move_them():
    scene = SCENE.with_changes(shading=0.6, tilt_deg=(0.0, 0.0, 170.0))
    found = find_target(picture(scene), GRID)
    assert np.abs((found.xy_px - scene.middles()).mean(axis=0)).max() < 0.01
    assert np.abs(found.xy_px - scene.middles()).max() < 0.07


def test_of_two_ways_up_circle_0_is_the_one_at_the_top_left():
    scene = SCENE.with_changes(rows=4, tilt_deg=(0.0, 0.0, 160.0))
    found = find_target(picture(scene), CircleGrid(4, 4, 24.0, 20.0))
    turned = scene.middles()[::-1]
    assert np.abs(found.xy_px - turned).max() < 0.1


def test_the_bias_is_that_of_the_conic():
    bias = centre_bias_px(camera_of(TILTED), pose_of(TILTED), GRID.points_mm.reshape(-1, 3), 20.0)
    wanted = TILTED.middles() - TILTED.centres()
    assert np.abs(wanted).max() > 0.1
    assert bias == pytest.approx(wanted, abs=2e-5)


def test_sightings_lose_their_bias_and_unknown_pictures_keep_it():
    geometry = RigGeometry(("eye",), 0, (camera_of(TILTED),), (Pose.identity(),))
    ids = np.arange(20, dtype=np.intp)
    seen = Sighting(3, 0, ids, TILTED.middles(), np.full(20, 0.02))
    other = Sighting(4, 0, ids, TILTED.middles(), np.full(20, 0.02))
    mended, left = without_bias(
        [seen, other], geometry, {3: pose_of(TILTED)}, GRID.points_mm.reshape(-1, 3), 20.0
    )
    assert mended.xy_px == pytest.approx(TILTED.centres(), abs=2e-5)
    assert left.xy_px == pytest.approx(TILTED.middles())


def lattice_px(grid: CircleGrid, degrees: float) -> Float:
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return grid.points_mm.reshape(-1, 3)[:, :2] @ turn.T + 200.0


@pytest.mark.parametrize("degrees", [0.0, 37.0, 90.0, 141.0, 180.0, 255.0])
def test_blobs_are_named_whichever_way_the_grid_lies(degrees: float):
    shown = lattice_px(GRID, degrees)
    mixed = np.random.default_rng(7).permutation(20)
    strays = np.array([[10.0, 10.0], [11.0, 400.0], [500.0, 20.0]])
    order, held = arrange(np.concatenate([shown[mixed], strays]), GRID)
    assert order is not None
    assert held == 20
    assert mixed[order].tolist() == list(range(20))


def test_one_missing_circle_leaves_no_arrangement():
    order, held = arrange(np.delete(lattice_px(GRID, 20.0), 7, axis=0), GRID)
    assert order is None
    assert held == 19
    assert arrange(np.empty((0, 2)), GRID) == (None, 0)


def test_a_part_is_refused_with_how_much_is_there():
    image = picture(TILTED)
    x, y = TILTED.middles()[0].astype(int)
    image[y - 16 : y + 17, x - 16 : x + 17] = 190
    error = refused(image, GRID)
    assert error.reason == "clipped"
    assert "found 19 of its 20 circles" in str(error)


def test_a_circle_without_white_around_it_is_told():
    low = TILTED.middles()[:, 0].min()
    cut = np.ascontiguousarray(picture(TILTED)[:, int(low) - 12 :])
    error = refused(cut, GRID)
    assert error.reason == "clipped"


def test_another_grid_is_told():
    error = refused(picture(TILTED), CircleGrid(5, 6, 24.0, 20.0))
    assert error.reason in ("clipped", "wrong-count")
    assert "20" in str(error)


def test_circles_too_close_in_the_picture_and_blurred_ones_are_told():
    wide = SCENE.with_changes(diameter_mm=30.0, distance_mm=700.0, blur_px=0.4)
    far = refused(picture(wide), CircleGrid(4, 5, 24.0, 30.0))
    assert far.reason == "too-small"
    assert "px of white between them" in str(far)
    blurred = refused(picture(SCENE.with_changes(blur_px=4.5)), GRID)
    assert blurred.reason == "blurred"


def test_darkness_and_pictures_without_circles_are_told():
    assert refused(np.full((120, 160), 3, np.uint8), GRID).reason == "under-exposed"
    flat = np.full((120, 160), 120, np.uint8)
    assert refused(flat, GRID).reason == "not-found"
    assert "found 0 dark circles" in str(refused(flat, GRID))
    one = cv2.circle(np.full((120, 160), 200, np.uint8), (70, 60), 15, 30, -1)
    assert "found 1 dark circle;" in str(refused(one, GRID))


@given(arrays(np.uint8, st.tuples(st.integers(16, 60), st.integers(16, 60))))
@settings(max_examples=25, deadline=None)
def test_any_small_picture_is_refused_with_a_reason(image: np.ndarray):
    with pytest.raises(TargetError) as told:
        find_target(image, GRID)
    assert told.value.reason
