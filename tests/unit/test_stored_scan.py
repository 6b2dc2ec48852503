"""The calibration of a camera that moves belongs to its positions, to the last of them."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.optics.calibrated import CalibratedOptics
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.records import StoredCalibration
from rig.stored import optics_of
from tests.support.small_scan import SMALL_SCAN


def rig(*more: str, row: str = "[-20.0, 0.0, 12.5]") -> Profile:
    return load_profile("sim-scan", (*SMALL_SCAN, f"camera.row.at_mm={row}", *more))


def calibration(profile: Profile) -> StoredCalibration:
    cameras = (CameraModel(160, 100, 152.5, 152.5, 79.5, 49.5),) * len(profile.views)
    poses = tuple(
        Pose(np.eye(3), np.array([-profile.pitch_mm * view.x_steps, 0.0, 0.0]))
        for view in profile.views
    )
    names = tuple(view.name for view in profile.views)
    return StoredCalibration(
        id=7,
        rig=profile.name,
        created_at=datetime(2026, 1, 1, tzinfo=UTC),
        geometry=geometry_to_json(RigGeometry(names, 0, cameras, poses)),
        quality={},
        profile=profile.model_dump(mode="json"),
        versions={},
        devices={},
        temperature_degc=None,
        image_size_px=(160, 100),
        active=True,
    )


def test_the_same_positions_have_their_calibration():
    optics = optics_of(
        rig("camera.settle_s=9.0", "stages.camera.speed_mm_s=1.0"), calibration(rig())
    )
    assert isinstance(optics, CalibratedOptics)
    np.testing.assert_allclose(sorted(optics.x_steps), [-1.0, 0.0, 0.625], atol=1e-9)


@pytest.mark.parametrize(
    ("now", "says"),
    [
        (rig(row="[-20.1, 0.0, 12.5]"), r"other positions of the camera \(views of the profile"),
        (rig("stages.camera.direction=-1"), "running in the direction 1, now it is -1"),
    ],
)
def test_other_positions_however_near_are_told(now: Profile, says: str):
    with pytest.raises(ConfigError, match=says):
        optics_of(now, calibration(rig()))


def test_a_calibration_from_before_there_were_named_stages_is_told():
    old = calibration(rig())
    bare = {key: value for key, value in old.profile.items() if key != "stages"}
    with pytest.raises(ConfigError, match=r"stages\.camera running in the direction None"):
        optics_of(rig(), replace(old, profile=bare))
