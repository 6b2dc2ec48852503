"""A new profile of an OAK that tells which sensors it has, on a stand-in for the device."""

import json
import tomllib
from collections.abc import Sequence
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.oak.answer import SensorAnswer, parse_sensors
from rig_drivers.oak.board import board_socket, require_sensors
from rig_drivers.oak.described import described_sensors
from rig_drivers.oak.new_views import views_of
from rig_drivers.oak.sdk import dai

from rig.discovery import Findings, FoundDevice
from rig.errors import ConfigError, DeviceNotFoundError
from rig.profile import OakCameraConfig, Profile
from rig.profile.load import parse_profile
from rig.profile.plugged import recipe_for
from rig.profile.template import profile_text
from tests.support.oak import IMX378, feature, oak_d, three_features

FOUND = [Findings("oak", "camera.device", (FoundDevice("18443010", "OAK on usb"),))]
STRAIGHT = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
OV7251 = ((640, 480, 100.0), (640, 400, 100.0))
AR0234 = ((1920, 1200, 60.0),)
IMX214 = ((4208, 3120, 30.0), (3840, 2160, 42.0), (1920, 1080, 60.0))


class Board:
    """An OAK as far as it is asked here."""

    def __init__(
        self, features: Sequence[dai.CameraFeatures], calibration: dai.CalibrationHandler
    ) -> None:
        self.features = list(features)
        self.calibration = calibration

    def getConnectedCameraFeatures(self) -> list[dai.CameraFeatures]:  # noqa: N802
        return self.features

    def readCalibration(self) -> dai.CalibrationHandler:  # noqa: N802
        return self.calibration


def calibrated(places_cm: dict[str, tuple[float, float]]) -> dai.CalibrationHandler:
    """An EEPROM with sensors at these places, x to the right and y down, linked in a row."""
    handler = dai.CalibrationHandler()
    sockets = list(places_cm)
    for name in sockets:
        matrix = [[800.0, 0.0, 640.5], [0.0, 800.0, 400.5], [0.0, 0.0, 1.0]]
        handler.setCameraIntrinsics(board_socket(name), matrix, dai.Size2f(1280.0, 800.0))
        handler.setDistortionCoefficients(board_socket(name), [0.0] * 14)
    for one, other in zip(sockets[1:], sockets, strict=False):
        way = [places_cm[one][axis] - places_cm[other][axis] for axis in (0, 1)]
        way = [*way, 0.0]
        handler.setCameraExtrinsics(board_socket(one), board_socket(other), STRAIGHT, way, way)
    return handler


def asked(board: Board) -> list[SensorAnswer]:
    """What the device tells, through the line of JSON that its process prints."""
    sensors = described_sensors(cast("dai.Device", board))
    return parse_sensors(json.dumps([sensor.model_dump() for sensor in sensors]), 0)


def profile_of(board: Board) -> Profile:
    told = views_of(asked(board), "18443010")
    recipe = recipe_for("b", FOUND, camera=None, views=None, stage=None, told=told)
    profile = parse_profile(tomllib.loads(profile_text(recipe)), source="new")
    assert isinstance(profile.camera, OakCameraConfig)
    # What was told must be what the driver then takes.
    require_sensors(board.features, profile.camera, profile.camera.sockets, "OAK")
    return profile


def oak(profile: Profile) -> OakCameraConfig:
    assert isinstance(profile.camera, OakCameraConfig)
    return profile.camera


def places(profile: Profile) -> dict[str, tuple[float, float]]:
    return {view.name: (view.x_steps, view.y_steps) for view in profile.views}


def test_an_oak_d_is_its_pair_and_the_colour_camera_between_as_its_eeprom_has_them():
    eeprom = calibrated({"CAM_C": (3.75, 0.0), "CAM_A": (0.0, 0.02), "CAM_B": (-3.7, 0.0)})
    profile = profile_of(Board(three_features(), eeprom))
    camera = oak(profile)
    assert camera.sockets == {"colour": "CAM_A", "left": "CAM_B", "right": "CAM_C"}
    assert (camera.size_of("left"), camera.size_of("colour")) == ((1280, 800), (1920, 1080))
    assert camera.of("colour").lens_position == 130
    assert camera.of("left").lens_position is None
    assert profile.pitch_mm == pytest.approx(37.0, abs=0.01)
    assert places(profile) == {"colour": (0.0, 0.0), "left": (-1.0, 0.0), "right": (1.01, 0.0)}
    assert profile.stage is not None


def test_an_eeprom_that_knows_not_all_of_them_leaves_the_places_of_the_kind():
    profile = profile_of(Board(three_features(), oak_d()))
    assert profile.pitch_mm == 37.5
    assert places(profile) == {"colour": (0, 0), "left": (-1, 0), "right": (1, 0)}


def test_a_colour_camera_without_autofocus_has_no_lens_to_lock():
    features = [
        feature("CAM_A", colour=True, name="IMX378", sizes=IMX378),
        *three_features()[1:],
    ]
    assert oak(profile_of(Board(features, oak_d()))).of("colour").lens_position is None


def test_a_lite_has_smaller_grey_pictures():
    features = [
        feature("CAM_A", focus=True, colour=True, name="IMX214", sizes=IMX214),
        feature("CAM_B", name="OV7251", sizes=OV7251),
        feature("CAM_C", name="OV7251", sizes=OV7251),
    ]
    camera = oak(profile_of(Board(features, oak_d())))
    assert camera.size_of("right") == (640, 480)
    assert camera.size_of("colour") == (1920, 1080)


def test_a_pair_without_a_colour_camera_is_the_pair():
    profile = profile_of(Board(three_features()[1:], oak_d()))
    assert oak(profile).sockets == {"left": "CAM_B", "right": "CAM_C"}
    assert profile.pitch_mm == 75.0
    assert places(profile) == {"left": (0.0, 0.0), "right": (1.0, 0.0)}


def test_three_colour_sensors_in_a_row_are_named_by_their_sockets():
    sockets = ("CAM_A", "CAM_B", "CAM_C")
    features = [feature(s, colour=True, name="AR0234", sizes=AR0234) for s in sockets]
    eeprom = calibrated({"CAM_A": (0.0, 0.0), "CAM_B": (-5.0, 0.0), "CAM_C": (10.0, 0.0)})
    profile = profile_of(Board(features, eeprom))
    assert places(profile) == {"cam_a": (0, 0), "cam_b": (-1, 0), "cam_c": (2, 0)}
    assert profile.pitch_mm == pytest.approx(50.0)
    assert oak(profile).size_of("cam_c") == (1920, 1200)
    assert oak(profile).of("cam_b").white_balance_k == 5000


def test_modules_on_ribbon_cables_have_sockets_but_no_places():
    sockets = ("CAM_A", "CAM_B", "CAM_C", "CAM_D")
    features = [
        feature("CAM_A", focus=True, colour=True, name="IMX378", sizes=IMX378),
        *(feature(socket) for socket in sockets[1:]),
    ]
    board = Board(features, dai.CalibrationHandler())
    profile = profile_of(board)
    assert list(oak(profile).sockets.values()) == list(sockets)
    assert list(places(profile).values())[:2] == [(0.0, 0.0), (0.93, 0.0)]
    assert views_of(asked(board), "x").built_in is None


def test_sensors_that_see_heat_or_times_of_flight_are_no_views():
    heat = feature("CAM_E", name="Tiny1C")
    heat.supportedTypes = [dai.CameraSensorType.THERMAL]
    profile = profile_of(Board([*three_features()[1:], heat], oak_d()))
    assert oak(profile).sockets == {"left": "CAM_B", "right": "CAM_C"}
    with pytest.raises(DeviceNotFoundError, match="no sensor that gives pictures"):
        views_of(asked(Board([heat], oak_d())), "x")


def test_a_device_with_one_sensor_is_one_camera_alone():
    board = Board(three_features()[:1], oak_d())
    told = views_of(asked(board), "18443010")
    recipe = recipe_for("b", FOUND, camera=None, views=None, stage=None, told=told)
    assert (recipe.views, recipe.stage) == (1, None)
    camera = oak(parse_profile(tomllib.loads(profile_text(recipe)), source="new"))
    assert camera.sockets == {"camera": "CAM_A"}
    require_sensors(board.features, camera, camera.sockets, "OAK")
    with pytest.raises(ConfigError, match="--stage none"):
        profile_text(recipe_for("b", FOUND, camera=None, views=None, stage="grbl", told=told))


@given(text=st.text() | st.binary().map(lambda data: data.decode("latin-1")))
def test_any_answer_is_a_list_of_sensors_or_an_error_of_ours(text: str):
    try:
        assert isinstance(parse_sensors(text, 1), list)
    except (ConfigError, DeviceNotFoundError) as error:
        assert str(error)
