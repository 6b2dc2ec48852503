"""The suite of cameras over cameras of your own.

    RIG_GENICAM_PROFILE=my-rig pytest --pyargs rig.testing.test_camera -p rig_genicam.testing

The suite wants two views or more, and shows whether cables, triggers and times are in order.
"""

import os

import pytest

from rig.devices import SystemClock
from rig.profile.kinds import Surroundings
from rig.profile.load import load_profile
from rig.testing import CameraCase
from rig_genicam.config import GenicamCameraConfig
from rig_genicam.kind import GENICAM


@pytest.fixture
def camera_case() -> CameraCase:
    """The cameras of the profile that the environment names, closed."""
    profile = load_profile(os.environ["RIG_GENICAM_PROFILE"])
    config = profile.camera
    if not isinstance(config, GenicamCameraConfig):
        pytest.fail(f"profile {profile.name} has no camera of kind genicam")
    clock = SystemClock()
    around = Surroundings(profile.name, profile.views, clock)
    return CameraCase(GENICAM.open(config, around), clock)
