"""What a calibration from scenes starts from, and in which order."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
import pytest

from rig.calibrate.scene_start import scene_start
from rig.errors import ConfigError
from rig.factory import FactoryCamera
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.records import StoredCalibration
from tests.support.scene_features import row_of

SIZES = [(640, 480), (640, 480)]
STATED = ("intrinsics={focal_px=451.0, centre_px=[299.0, 255.0]}",)


def a_pair(*overrides: str) -> Profile:
    return load_profile("checkerboard-stereo", overrides)


def stored(profile: Profile, number: int = 3, **quality: object) -> StoredCalibration:
    geometry = replace(row_of((0.1, 0.0, 0.0)), names=tuple(v.name for v in profile.views))
    return StoredCalibration(
        number, profile.name, datetime.now(UTC), geometry_to_json(geometry), quality,
        {}, {}, {}, None, (640, 480), active=True,
    )  # fmt: skip


@dataclass
class Device:
    """An opened camera that holds its maker's calibration."""

    factory_calibration: list[FactoryCamera] | None


def factory(profile: Profile) -> Device:
    matrix = ((440.0, 0.0, 320.0), (0.0, 440.0, 240.0), (0.0, 0.0, 1.0))
    eye = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return Device(
        [
            FactoryCamera(view.name, 640, 480, matrix, (0.0,) * 5, False, eye, (75.0 * k, 0.0, 0.0))
            for k, view in enumerate(profile.views)
        ]
    )


def test_what_the_profile_states_stands_at_nominal_places():
    profile = a_pair(*STATED)
    start = scene_start(profile, SIZES, None, stored(profile), factory(profile))
    assert start.source == "451.0 px as the profile states"
    camera = start.geometry.cameras[1]
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (451.0, 451.0, 299.0, 255.0)
    other = start.geometry.cam_from_reference[1]
    assert np.array_equal(other.rotation, np.eye(3))
    assert other.translation_mm[0] == -profile.pitch_mm * profile.views[1].x_steps
    sure = start.sure
    assert (sure.focal_pct, sure.turn_deg, sure.direction_deg) == (0.5, 2.0, 2.0)
    assert (sure.length_pct, sure.centre_px) == (0.5, pytest.approx(3.2))


def test_the_middle_of_a_picture_is_less_sure():
    start = scene_start(a_pair("intrinsics.focal_px=451.0"), SIZES, None, None, None)
    assert start.geometry.cameras[0].cx_px == 319.5
    assert start.geometry.cameras[0].cy_px == 239.5
    assert start.sure.centre_px == pytest.approx(12.8)


def test_views_may_have_focal_lengths_of_their_own():
    names = [view.name for view in a_pair().views]
    one = f"intrinsics.focal_px={{{names[0]}=400.0, {names[1]}=500.0}}"
    start = scene_start(a_pair(one), SIZES, None, None, None)
    assert [camera.fx_px for camera in start.geometry.cameras] == [400.0, 500.0]


def test_a_focal_length_of_no_view_is_named():
    with pytest.raises(ConfigError, match=r"intrinsics\.focal_px must name every view once"):
        a_pair("intrinsics.focal_px={nobody=400.0}")


def test_a_named_calibration_comes_first():
    profile = a_pair(*STATED)
    start = scene_start(profile, SIZES, stored(profile, 5, imported="ros"), None, None)
    assert start.source == "calibration 5"
    assert start.sure.focal_pct == 0.1
    assert start.sure.turn_deg == 1.0


def test_a_stored_calibration_comes_before_the_device():
    profile = a_pair()
    start = scene_start(profile, SIZES, None, stored(profile), factory(profile))
    assert start.source == "calibration 3"
    assert start.sure.focal_pct == 0.5


def test_a_calibration_from_a_scene_is_no_start():
    profile = a_pair()
    start = scene_start(profile, SIZES, None, stored(profile, from_scene={}), factory(profile))
    assert start.source == "the factory's calibration"
    assert start.geometry.cameras[0].fx_px == 440.0
    assert start.sure.focal_pct == 0.3


def test_nobody_who_knows_a_focal_length_is_an_error():
    with pytest.raises(ConfigError, match="nothing tells its focal length") as told:
        scene_start(a_pair(), SIZES, None, None, Device(None))
    assert "[intrinsics] focal_px" in told.value.advice


def test_pictures_of_another_size_are_named():
    profile = a_pair()
    with pytest.raises(ConfigError, match="of 640 x 480, 640 x 480 px, these are of 320 x 240"):
        scene_start(profile, [(320, 240)] * 2, stored(profile), None, None)


def test_other_views_are_named():
    profile = a_pair()
    other = replace(stored(profile), geometry=geometry_to_json(row_of((0.0, 0.0, 0.0), (0, 0, 0))))
    with pytest.raises(ConfigError, match="calibration 3 is of the views left, right, far"):
        scene_start(profile, SIZES, other, None, None)
