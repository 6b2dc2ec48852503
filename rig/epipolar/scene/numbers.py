"""A geometry as the row of numbers that its covariance is over, and back."""

from dataclasses import replace

import numpy as np

from rig.arrays import Float
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

POSE = 6
_STEP_PX, _STEP_LENS, _STEP_RAD, _STEP_MM = 1e-3, 1e-6, 1e-7, 1e-4
"""Of numerical derivatives: projections are smooth, so central differences give 8 digits."""


def numbers_of(geometry: RigGeometry) -> Float:
    """(P,) numbers in the order that `RigGeometry` tells."""
    lenses = [
        [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.coefficients]
        for camera in geometry.cameras
    ]
    places = [
        [*pose.rotation_rad, *pose.translation_mm]
        for view, pose in enumerate(geometry.cam_from_reference)
        if view != geometry.reference
    ]
    return np.array([number for part in (*lenses, *places) for number in part], np.float64)


def with_numbers(geometry: RigGeometry, numbers: Float) -> RigGeometry:
    """Return the geometry with other numbers (P,), without a covariance."""
    cameras: list[CameraModel] = []
    places: list[Pose] = []
    for view, camera in enumerate(geometry.cameras):
        own, pose = lens_slice(geometry, view), pose_slice(geometry, view)
        fx_px, fy_px, cx_px, cy_px, *coefficients = numbers[own].tolist()
        cameras.append(
            replace(
                camera,
                fx_px=fx_px,
                fy_px=fy_px,
                cx_px=cx_px,
                cy_px=cy_px,
                coefficients=tuple(coefficients),
            )
        )
        there = numbers[pose]
        is_other = view != geometry.reference
        places.append(Pose.from_vectors(there[:3], there[3:]) if is_other else Pose.identity())
    return replace(
        geometry, cameras=tuple(cameras), cam_from_reference=tuple(places), covariance=None
    )


def lens_slice(geometry: RigGeometry, view: int) -> slice:
    """Where the intrinsics of a view are."""
    sizes = [4 + len(camera.coefficients) for camera in geometry.cameras]
    return slice(sum(sizes[:view]), sum(sizes[: view + 1]))


def pose_slice(geometry: RigGeometry, view: int) -> slice:
    """Where its place is: Rodrigues vector, then translation; empty for the reference."""
    lenses = lens_slice(geometry, len(geometry.cameras) - 1).stop
    if view == geometry.reference:
        return slice(lenses, lenses)
    first = lenses + POSE * (view - (view > geometry.reference))
    return slice(first, first + POSE)


def steps_of(geometry: RigGeometry) -> Float:
    """(P,) steps of numerical derivatives."""
    steps: list[float] = []
    for camera in geometry.cameras:
        steps += [_STEP_PX] * 4 + [_STEP_LENS] * len(camera.coefficients)
    steps += ([_STEP_RAD] * 3 + [_STEP_MM] * 3) * (len(geometry.cameras) - 1)
    return np.array(steps)
