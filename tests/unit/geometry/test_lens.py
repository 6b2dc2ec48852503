"""Lens models at the places where they end: folds, the axis, and beyond a radian."""

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import COEFFICIENTS, LensModel, distort, undistort

TURNED_BACK = (0.75, -0.75, 0.0, 0.0, 0.0)
"""At radius 1 the picture lies where it would without a lens and runs backwards: its radial rate
is 1 + 3 k1 + 5 k2 = -0.5, the tangential one 1."""


@pytest.mark.parametrize("angle_deg", [0.0, 45.0, 90.0, 160.0])
def test_a_place_that_runs_backwards_is_no_inverse(angle_deg: float) -> None:
    at = np.array([[np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))]])
    there = distort("brown5", np.array(TURNED_BACK), at)
    assert there.xy == pytest.approx(at, abs=1e-12)
    assert np.linalg.eigvalsh(there.by_xy[0]) == pytest.approx([-0.5, 1.0], abs=1e-12)
    assert np.isnan(undistort("brown5", np.array(TURNED_BACK), at)).all()


def test_a_lens_that_shrinks_is_inverted_all_around() -> None:
    around = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    ideal = 0.6 * np.stack([np.cos(around), np.sin(around)], axis=1)
    k = np.array([-0.3, 0.02, 0.001, -0.002, 0.0])
    assert undistort("brown5", k, distort("brown5", k, ideal).xy) == pytest.approx(ideal, abs=1e-12)


def test_one_point_without_an_inverse_leaves_the_others_alone() -> None:
    k = np.array([-0.5, 0.0, 0.0, 0.0, 0.0])
    wanted = np.array([[0.9, 0.0], [0.3, 0.2], [np.nan, 0.0], [-0.1, 0.4]])
    found = undistort("brown5", k, wanted)
    assert np.isnan(found).any(axis=1).tolist() == [True, False, True, False]
    assert distort("brown5", k, found[[1, 3]]).xy == pytest.approx(wanted[[1, 3]], abs=1e-12)


@pytest.mark.parametrize("angle_rad", [0.0, 1e-9, 1e-3, 0.8, 1.2, 1.45])
def test_a_fisheye_without_coefficients_shows_the_angle(angle_rad: float) -> None:
    direction = np.array([[0.6, -0.8]])
    found = undistort("fisheye", np.zeros(4), angle_rad * direction)
    assert found == pytest.approx(np.tan(angle_rad) * direction, rel=1e-12, abs=1e-15)
    back = distort("fisheye", np.zeros(4), found).xy
    assert back == pytest.approx(angle_rad * direction, rel=1e-12, abs=1e-15)


def test_a_fisheye_bends_by_odd_powers_of_the_angle() -> None:
    k = np.array([0.1, -0.02, 0.003, 0.0004])
    angle = 0.9
    at = np.array([[np.tan(angle), 0.0], [0.0, -np.tan(angle)]])
    powers = angle ** np.array([3.0, 5.0, 7.0, 9.0])
    bent = angle + float(k @ powers)
    found = distort("fisheye", k, at)
    assert found.xy == pytest.approx(np.array([[bent, 0.0], [0.0, -bent]]), abs=1e-14)
    assert found.by_coefficients[0, 0] == pytest.approx(powers, rel=1e-12)
    assert found.by_coefficients[1, 1] == pytest.approx(-powers, rel=1e-12)
    assert found.by_coefficients[0, 1] == pytest.approx(np.zeros(4), abs=1e-15)
    # Radial: (1 + 3 k1 a^2 + ...) da/dr with r = tan a; tangential: bent / r.
    radial = 1 + float(k * np.array([3, 5, 7, 9]) @ (powers / angle))
    expected = np.diag([radial * np.cos(angle) ** 2, bent / np.tan(angle)])
    assert found.by_xy[0] == pytest.approx(expected, abs=1e-14)


def test_on_the_axis_every_lens_is_none() -> None:
    for model, count in COEFFICIENTS.items():
        found = distort(model, np.full(count, 0.01), np.zeros((1, 2)))
        assert found.xy.tolist() == [[0.0, 0.0]]
        assert found.by_xy[0].tolist() == [[1.0, 0.0], [0.0, 1.0]]
        assert found.by_coefficients.shape == (1, 2, count)
        assert not found.by_coefficients.any()


@pytest.mark.parametrize(("model", "count"), [("none", 1), ("brown5", 4), ("fisheye", 5)])
def test_a_wrong_number_of_coefficients_is_told(model: LensModel, count: int) -> None:
    with pytest.raises(
        ConfigError, match=f"{model} asked for with {count} .*{COEFFICIENTS[model]}"
    ):
        distort(model, np.zeros(count), np.zeros((1, 2)))


def test_tangential_terms_are_those_of_brown() -> None:
    x, y = 0.3, -0.2
    r2 = 0.13
    found = distort("brown5", np.array([0.0, 0.0, 0.01, 0.02, 0.0]), np.array([[x, y]]))
    expected = [
        x + 0.02 * x * y + 0.02 * (r2 + 2 * x * x),
        y + 0.01 * (r2 + 2 * y * y) + 0.04 * x * y,
    ]
    assert found.xy[0] == pytest.approx(expected, abs=1e-15)


def test_a_rational_lens_divides_by_its_last_three() -> None:
    k = np.array([0.1, 0.2, 0.0, 0.0, 0.3, 0.4, 0.5, 0.6])
    found = distort("brown8", k, np.array([[0.6, 0.8]]))
    assert found.xy[0] == pytest.approx(np.array([0.6, 0.8]) * 1.6 / 2.5, abs=1e-15)


@pytest.mark.parametrize("size", [(0, 1), (1, 0)])
def test_a_picture_without_pixels_is_refused(size: tuple[int, int]) -> None:
    assert CameraModel(1, 1, 1.0, 1.0, 0.0, 0.0).matrix.tolist() == np.eye(3).tolist()
    with pytest.raises(ConfigError, match=f"camera of {size[0]} x {size[1]} px"):
        CameraModel(*size, 1.0, 1.0, 0.0, 0.0)


@pytest.mark.parametrize("focal_px", [(0.0, 1.0), (1.0, 0.0), (np.nan, 1.0), (1.0, np.inf)])
def test_focal_lengths_that_are_none_are_refused(focal_px: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match="must be positive and all its numbers finite"):
        CameraModel(4, 3, *focal_px, 0.0, 0.0)


def test_two_focal_lengths_and_a_middle_make_pixels() -> None:
    camera = CameraModel(40, 30, 100.0, 200.0, 20.0, 15.0)
    points = np.array([[1.0, 2.0, 10.0], [1.0, 2.0, 0.0], [1.0, 2.0, -10.0]])
    assert camera.project(points)[0].tolist() == [30.0, 55.0]
    assert np.isnan(camera.project(points)[1:]).all()
    assert camera.unproject(np.array([[30.0, 55.0]])).tolist() == [[0.1, 0.2]]
    assert camera.matrix.tolist() == [[100.0, 0.0, 20.0], [0.0, 200.0, 15.0], [0.0, 0.0, 1.0]]
