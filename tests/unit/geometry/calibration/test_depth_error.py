"""How depth moves with the geometry, against triangulation; and epipolar distances."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import CalibrationError
from rig.geometry.bundle.depth_error import depth_errors, depth_gradient, depth_sigma_mm
from rig.geometry.bundle.epipolar import epipolar_error
from rig.geometry.bundle.result import Residuals
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from tests.support.calibration_scene import HEIGHT, WIDTH, TrueCamera, random_scene, turn

SCENE = random_scene(8, 1)
PIXELS = np.array([[700.0, 330.0]])
DISTANCE_MM = 800.0


def geometry_at(values: np.ndarray) -> RigGeometry:
    """Geometry of a parameter vector, in the order of its covariance."""
    cameras = tuple(
        CameraModel(WIDTH, HEIGHT, fx, fy, cx, cy, "brown5", tuple(lens))
        for fx, fy, cx, cy, *lens in values[:27].reshape(3, 9).tolist()
    )
    places = [Pose.from_vectors(v[:3], v[3:]) for v in values[27:].reshape(2, 6)]
    return RigGeometry(("a", "b", "c"), 0, cameras, (Pose.identity(), *places))


def true_values() -> np.ndarray:
    cameras = [camera for camera in SCENE.cameras if isinstance(camera, TrueCamera)]
    places = []
    for camera in cameras[1:]:
        # Turned farther than rigs are, so that Rodrigues vector and turn differ.
        rotation = turn(np.add(camera.turned_deg, (1.0, -2.0, 8.0)))
        shift = -rotation @ np.array(camera.centre_mm)
        places += [*Pose(rotation, shift).rotation_rad, *shift]
    return np.concatenate([*(camera.numbers for camera in cameras), places])


def triangulated_mm(geometry: RigGeometry, shown: list[np.ndarray], start: np.ndarray) -> float:
    """Depth of the point that projects nearest to the pixels."""
    at = start.copy()
    for _ in range(3):
        rows, off = [], []
        for view, pixel in enumerate(shown):
            here = geometry.project(view, at[None])[0]
            ahead = geometry.project(view, at + 1e-3 * np.eye(3))
            behind = geometry.project(view, at - 1e-3 * np.eye(3))
            rows.append((ahead - behind).T / 2e-3)
            off.append(pixel - here)
        at += np.linalg.lstsq(np.concatenate(rows), np.concatenate(off))[0]
    return float(at[2])


def test_depth_moves_with_every_parameter_as_the_gradient_says():
    values = true_values()
    geometry = geometry_at(values)
    gradient = depth_gradient(geometry, DISTANCE_MM, PIXELS)
    rays = geometry.cameras[0].unproject(PIXELS)
    for n, (x, y) in enumerate(rays):
        point = np.array([x, y, 1.0]) * DISTANCE_MM
        shown = [geometry.project(view, point[None])[0] for view in range(3)]
        assert all(((u > 0) & (u < (WIDTH, HEIGHT))).all() for u in shown)
        for number, value in enumerate(values):
            step = 1e-6 * max(abs(value), 1.0)
            off = np.zeros(len(values))
            off[number] = step
            ahead = triangulated_mm(geometry_at(values + off), shown, point)
            behind = triangulated_mm(geometry_at(values - off), shown, point)
            wanted = (ahead - behind) / (2 * step)
            assert gradient[n, number] == pytest.approx(wanted, rel=1e-4, abs=1e-4)


def test_a_focal_length_alone_moves_depth_in_proportion():
    values = np.tile([900.0, 900.0, 639.5, 399.5, 0, 0, 0, 0, 0], 3)
    values = np.concatenate([values, [0, 0, 0, -75, 0, 0], [0, 0, 0, 0, -75, 0]])
    geometry = geometry_at(values)
    # One focal length for all, known to 0.1 %: 0.1 % of depth, at every place and distance.
    covariance = np.zeros((39, 39))
    lengths = [view * 9 + axis for view in range(3) for axis in range(2)]
    covariance[np.ix_(lengths, lengths)] = 0.9**2
    geometry = replace(geometry, covariance=covariance)
    middle = np.array([[639.5, 399.5]])
    assert depth_sigma_mm(geometry, 2000.0, middle) == pytest.approx([2.0], rel=1e-6)
    for error in depth_errors(geometry):
        assert error.picture_pct == pytest.approx(0.2, rel=0.05)


def test_a_geometry_without_covariance_has_no_depth_error():
    with pytest.raises(CalibrationError, match="without covariance"):
        depth_errors(geometry_at(true_values()))


def test_epipolar_distances_are_those_of_the_pixels():
    geometry = geometry_at(
        np.concatenate(
            [np.tile([900.0, 900.0, 640.0, 400.0, 0, 0, 0, 0, 0], 3), [0, 0, 0, -75, 0, 0] * 2]
        )
    )
    ids = np.arange(4)
    xy_px = np.array([[300.0, 200.0], [500.0, 210.0], [700.0, 600.0], [900.0, 650.0]])
    other = xy_px - (60.0, 0.0) + np.array([[0, 0.1], [0, 0.1], [0, -0.3], [0, 5.0]])
    outlier = np.array([False, False, False, True])

    def seen(view: int, found: np.ndarray) -> Residuals:
        return Residuals(0, view, ids, found, found, np.ones(4), outlier, found)

    error = epipolar_error(geometry, [seen(0, xy_px), seen(1, other)])
    assert error.mean_px == pytest.approx(0.5 / 3, rel=1e-9)
    assert error.max_px == pytest.approx(0.3, rel=1e-9)
    assert np.isnan(epipolar_error(geometry, [seen(0, xy_px)]).mean_px)
