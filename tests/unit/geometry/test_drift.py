"""Drift of a rig against a calibration whose error is drawn from its own covariance."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import TargetError
from rig.geometry.camera_model import CameraModel
from rig.geometry.drift import measure_drift
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import BoardPose, Scene, TrueCamera, flat_board_mm, turn

PLACES_MM = ((0.0, 0.0, 0.0), (60.0, 0.0, 1.0), (0.0, 65.0, -1.0))
TURNED_DEG = ((0.0, 0.0, 0.0), (0.3, -0.4, 0.2), (-0.2, 0.5, 0.1))
POSES = tuple(
    BoardPose((x, y, z), (t, u, 5.0))
    for x, y, z, t, u in [
        (0, 0, 600, 0, 0), (80, 30, 700, 20, 5), (-80, 30, 700, -15, 20), (60, -40, 800, 10, -25),
        (-60, -40, 500, -20, -10), (0, 50, 900, 25, 15), (0, -50, 650, -25, -15),
        (90, 0, 750, 5, 30),
    ]
)  # fmt: skip
"""What the calibration has seen."""


CAMERAS = tuple(
    TrueCamera(place, turned, lens=(-0.05, 0.02, 0.0, 0.0, 0.0))
    for place, turned in zip(PLACES_MM, TURNED_DEG, strict=True)
)


def scene(cameras: tuple[TrueCamera, ...] = CAMERAS, corner_px: float = 0.02) -> Scene:
    pose = BoardPose((20.0, -10.0, 700.0), (8.0, -12.0, 3.0))
    return Scene(cameras, (pose,), corner_px)


def geometry_of(parameters: Float) -> RigGeometry:
    """Nine numbers of each camera, then six of each pose but the first."""
    cameras = tuple(
        CameraModel(1280, 800, p[0], p[1], p[2], p[3], "brown5", tuple(p[4:].tolist()))
        for p in parameters[:27].reshape(3, 9)
    )
    moved = [Pose.from_vectors(p[:3], p[3:]) for p in parameters[27:].reshape(2, 6)]
    return RigGeometry(("a", "b", "c"), 0, cameras, (Pose.identity(), *moved))


def true_parameters() -> Float:
    parts = [camera.numbers for camera in CAMERAS]
    for camera in CAMERAS[1:]:
        rotation = turn(camera.turned_deg)
        place_mm = -rotation @ np.array(camera.centre_mm)
        parts += [Pose(rotation, place_mm).rotation_rad, place_mm]
    return np.concatenate(parts)


@cache
def covariance() -> Float:
    """Of a calibration from `POSES` with the corners' noise: the inverse of its information."""
    truth, board = true_parameters(), flat_board_mm()
    steps = np.array([1e-3, 1e-3, 1e-3, 1e-3, *[1e-6] * 5] * 3 + [*[1e-7] * 3, *[1e-4] * 3] * 2)

    def shown(parameters: Float, pose: Pose) -> Float:
        rig = geometry_of(parameters)
        return np.concatenate([rig.project(v, pose.apply(board)).ravel() for v in range(3)])

    information = np.zeros((39, 39))
    for at in POSES:
        vector = np.r_[np.radians(at.turned_deg), at.middle_mm]

        def column(place: int, vector: Float = vector) -> Float:
            change = np.zeros(45)
            change[place] = step = np.r_[steps, [1e-7] * 3, [1e-4] * 3][place]
            ends = [
                shown(truth + sign * change[:39], Pose.from_vectors(v[:3], v[3:]))
                for sign in (1.0, -1.0)
                for v in [vector + sign * change[39:]]
            ]
            return (ends[0] - ends[1]) / (2.0 * step)

        jacobian = np.stack([column(place) for place in range(45)], axis=1) / 0.02
        full = jacobian.T @ jacobian
        information += full[:39, :39] - full[:39, 39:] @ np.linalg.solve(
            full[39:, 39:], full[39:, :39]
        )
    scale = 1.0 / np.sqrt(np.diag(information))
    return np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)


def calibrated(seed: int) -> RigGeometry:
    """The truth, off by as much as the covariance says."""
    spread = np.linalg.cholesky(covariance())
    error = spread @ np.random.default_rng([seed, 1]).standard_normal(39)
    return replace(geometry_of(true_parameters() + error), covariance=covariance())


@pytest.mark.slow
def test_chance_alone_gives_every_probability_alike():
    found = [
        measure_drift(calibrated(seed), flat_board_mm(), scene().sightings(seed)).probability
        for seed in range(24)
    ]
    assert sum(p < 0.01 for p in found) <= 2
    assert 0.3 < float(np.mean(found)) < 0.7


@pytest.mark.slow
@pytest.mark.parametrize("corner_px", [0.005, 0.1])
def test_the_noise_is_that_of_the_corners_whatever_it_is(corner_px: float):
    drift = measure_drift(calibrated(3), flat_board_mm(), scene(corner_px=corner_px).sightings(3))
    assert drift.probability > 0.01
    assert 12 <= drift.dof <= 39  # poses of two views at least, pose and lens of three at most


def drawn_by_phase(seed: int, distance_mm: float) -> tuple[RigGeometry, list[Sighting]]:
    """Cameras and a board square to the pixels: corners of a row err alike."""
    straight = true_parameters()
    straight[27:30] = straight[33:36] = 0.0
    straight[30:33], straight[36:39] = -np.array(PLACES_MM[1]), -np.array(PLACES_MM[2])
    error = np.linalg.cholesky(covariance()) @ np.random.default_rng(seed).standard_normal(39)
    cameras = tuple(replace(camera, turned_deg=(0.0, 0.0, 0.0)) for camera in CAMERAS)
    pose = BoardPose((20.0, -10.0, distance_mm), (1.0, -1.5, 0.0))
    found = [
        replace(s, xy_px=s.xy_px + 0.015 * np.sin(2.0 * np.pi * s.xy_px))
        for s in Scene(cameras, (pose,), 0.01).sightings(seed)
    ]
    return replace(geometry_of(straight + error), covariance=covariance()), found


@pytest.mark.slow
@pytest.mark.parametrize("distance_mm", [735.0, 1160.0])
def test_what_repeats_with_the_pixels_is_no_drift(distance_mm: float):
    """30 and 19 px a square, which without the phase among the freedoms has chi2 of 2 to 5."""
    found = [
        measure_drift(geometry, flat_board_mm(), seen).chi2_per_dof
        for geometry, seen in (drawn_by_phase(seed, distance_mm) for seed in (1, 2, 3))
    ]
    assert max(found) < 1.7  # of 36 degrees of freedom, under 1 %


def test_a_camera_that_was_knocked_is_found_and_named():
    moved = list(CAMERAS)
    moved[1] = replace(moved[1], turned_deg=(0.3, -0.4 + 0.1, 0.2))  # 0.1 degrees about y: 1.5 px
    drift = measure_drift(calibrated(4), flat_board_mm(), scene(cameras=tuple(moved)).sightings(4))
    assert drift.probability < 1e-6
    assert drift.chi2_per_dof > 10.0
    lengths = {view: np.hypot(*shift) for view, shift in drift.displaced_px.items()}
    assert max(lengths, key=lambda view: lengths[view]) == 1
    assert drift.rms_px > 0.2


def test_a_longer_focal_length_is_found():
    """4 mm of drift in a morning: one lens that warms, 0.5 % longer."""
    moved = list(CAMERAS)
    moved[2] = replace(moved[2], focal_px=(886.4, 886.4))
    drift = measure_drift(calibrated(5), flat_board_mm(), scene(cameras=tuple(moved)).sightings(5))
    assert drift.probability < 1e-6


def test_one_view_tells_nothing():
    with pytest.raises(TargetError, match="two are needed"):
        measure_drift(calibrated(6), flat_board_mm(), scene().sightings(6)[:1])


def test_without_a_covariance_there_is_no_test():
    geometry = replace(calibrated(7), covariance=None)
    with pytest.raises(ValueError, match="covariance"):
        measure_drift(geometry, flat_board_mm(), scene().sightings(7))
