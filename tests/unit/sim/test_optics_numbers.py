"""Rays and pixels of a true camera by numbers worked out by hand."""

import numpy as np
import pytest
from rig_sim.optics import TrueCamera, distorted, rotation_matrix, undistorted

NONE = (0.0, 0.0, 0.0, 0.0, 0.0)
ONE = np.array(1.0)


def camera(**changes: object) -> TrueCamera:
    values: dict[str, object] = {
        "view": "it",
        "width_px": 3,
        "height_px": 2,
        "focal_px": 100.0,
        "centre_px": (10.0, 20.0),
        "position_mm": (1.0, 2.0, 3.0),
        "rotation_deg": (0.0, 0.0, 0.0),
        "distortion": NONE,
    }
    return TrueCamera(**(values | changes))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("coefficients", "x", "y"),
    [
        # x = 1, y = 2: r2 = 5, r4 = 25, r6 = 125, 2 x y = 4
        (NONE, 1.0, 2.0),
        ((0.01, 0.0, 0.0, 0.0, 0.0), 1.05, 2.1),
        ((0.0, 0.001, 0.0, 0.0, 0.0), 1.025, 2.05),
        ((0.0, 0.0, 0.0, 0.0, 0.0001), 1.0125, 2.025),
        ((0.0, 0.0, 0.01, 0.0, 0.0), 1.04, 2.13),
        ((0.0, 0.0, 0.0, 0.01, 0.0), 1.07, 2.04),
        ((0.01, 0.001, 0.01, 0.01, 0.0001), 1.1975, 2.345),
    ],
)
def test_every_coefficient_does_its_part(
    coefficients: tuple[float, float, float, float, float], x: float, y: float
):
    found = distorted(ONE, 2.0 * ONE, coefficients)
    assert (float(found[0]), float(found[1])) == pytest.approx((x, y), abs=1e-12)


@pytest.mark.parametrize("index", range(5))
def test_a_camera_with_any_coefficient_distorts(index: int):
    coefficients = [0.0] * 5
    coefficients[index] = 1e-3
    assert camera(distortion=tuple(coefficients)).distorts
    assert not camera().distorts


def test_undoing_goes_on_until_nothing_changes_in_x_and_in_y():
    coefficients = (-0.15, 0.02, 0.001, -0.002, 0.003)
    for x, y in ((0.6, 0.0), (0.0, 0.6), (0.5, 0.4), (-0.4, 0.2)):
        seen = distorted(np.array([x]), np.array([y]), coefficients)
        free = undistorted(*seen, coefficients)
        assert (free[0][0], free[1][0]) == pytest.approx((x, y), abs=3e-10)


def test_without_distortion_nothing_has_to_be_undone():
    assert undistorted(ONE, 2.0 * ONE, NONE) == (1.0, 2.0)


def test_rays_and_pixels_of_an_upright_camera():
    seen = camera()
    rays = seen.directions(np.array([10.0, 60.0]), np.array([20.0, 120.0]))
    assert rays.tolist() == [[0.0, 0.0, 1.0], [0.5, 1.0, 1.0]]
    assert seen.pixels(np.array([2.0, 4.0, 8.0])).tolist() == [30.0, 60.0]


def test_a_camera_turned_to_the_right_sees_what_is_ahead_of_it_on_the_left():
    turned = camera(rotation_deg=(0.0, 45.0, 0.0), position_mm=(0.0, 0.0, 0.0))
    assert turned.rotation @ [0.0, 0.0, 1.0] == pytest.approx(np.array([1, 0, 1]) / np.sqrt(2.0))
    assert turned.pixels(np.array([0.0, 0.0, 500.0])) == pytest.approx([-90.0, 20.0])


def test_a_grid_holds_all_pixels_of_the_picture():
    x_px, y_px = camera().pixel_grid()
    assert x_px.tolist() == [[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]]
    assert y_px.tolist() == [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]
    assert x_px.dtype == y_px.dtype == np.float64


@pytest.mark.parametrize(
    ("rotation_deg", "image"),
    [
        ((90.0, 0.0, 0.0), (1, 3, -2)),
        ((0.0, 90.0, 0.0), (-3, 2, 1)),
        ((0.0, 0.0, 90.0), (2, -1, 3)),
    ],
)
def test_a_quarter_turn_about_each_axis(
    rotation_deg: tuple[float, float, float], image: tuple[int, int, int]
):
    back = rotation_matrix(rotation_deg).T
    assert back @ [1, 2, 3] == pytest.approx(image)


def test_a_turn_about_a_slanted_axis_leaves_the_axis_alone():
    turn = rotation_matrix((40.0, -30.0, 120.0))  # 130 degrees
    assert turn @ [4, -3, 12] == pytest.approx([4, -3, 12])
    assert np.trace(turn) == pytest.approx(1.0 + 2.0 * np.cos(np.radians(130.0)))
    assert turn @ turn.T == pytest.approx(np.eye(3))
    assert rotation_matrix((0.0, 0.0, 0.0)).tolist() == np.eye(3).tolist()
