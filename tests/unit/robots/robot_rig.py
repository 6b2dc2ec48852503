"""A calibrated rig of five views with tilted cameras and lenses, known in closed form."""

from functools import cache

import numpy as np

from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.stored import Run
from rig.testing.simulated import PROFILE

LENSES = ("brown5", "brown8", "fisheye", "none", "brown5")
COEFFICIENTS = {
    "brown5": (-0.05, 0.01, 0.001, -0.0005, 0.0),
    "brown8": (-0.05, 0.01, 0.001, -0.0005, 0.0, 0.01, 0.002, 0.0),
    "fisheye": (0.01, -0.002, 0.0, 0.0),
    "none": (),
}


def profile() -> Profile:
    return load_profile(str(PROFILE))


@cache
def geometry() -> RigGeometry:
    """Reference first; the array is tilted by 4 deg against its reference camera."""
    views, pitch_mm = profile().views, profile().pitch_mm
    tilt = Pose.from_vectors(np.array([0.03, 0.07, 0.0]), np.zeros(3)).rotation
    cameras: list[CameraModel] = []
    poses: list[Pose] = []
    for number, view in enumerate(views):
        lens = LENSES[number]
        cameras.append(
            CameraModel(
                160, 100, 152.5 + number, 152.0, 79.0, 50.0 + number, lens, COEFFICIENTS[lens]
            )
        )
        forward_mm = 1.5 * number
        centre_mm = tilt @ np.array([view.x_steps * pitch_mm, view.y_steps * pitch_mm, forward_mm])
        turn = Pose.from_vectors(np.array([0.01, -0.02, 0.005]) * number, np.zeros(3)).rotation
        poses.append(Pose(turn, -turn @ centre_mm))
    names = tuple(view.name for view in views)
    return RigGeometry(names, 0, tuple(cameras), tuple(poses))


def run() -> Run:
    return Run(profile(), optics())


def optics() -> CalibratedOptics:
    return calibrated_optics(profile(), geometry(), calibration_id=1)
