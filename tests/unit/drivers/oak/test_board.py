"""What a board is asked for, and what is refused before anything starts."""

from collections.abc import Mapping
from typing import cast

import pytest
from rig_drivers.oak.bandwidth import needed_mb_s, require_bandwidth
from rig_drivers.oak.board import (
    Mode,
    board_socket,
    camera_outputs,
    device_config,
    require_one_sync_line,
    require_sensors,
    resized,
    sync_mode,
)
from rig_drivers.oak.sdk import dai

from rig.errors import ConfigError, DeviceNotFoundError
from rig.profile import OakCameraConfig
from tests.support.oak import feature, oak_config, three_features, three_views

PAIR = {"left": "CAM_B", "right": "CAM_C"}
FOUR = ("left", "right", "top", "bottom")


def test_the_sync_lines_of_an_ffc_4p_are_joined_by_one_pin():
    assert len(device_config(oak_config()).board.gpio) == 0
    gpio = device_config(oak_config(joins_sync_lines=True)).board.gpio
    assert dict(gpio.items()).keys() == {6}
    assert gpio[6].direction == dai.BoardConfig.GPIO.Direction.OUTPUT
    assert gpio[6].level == dai.BoardConfig.GPIO.Level.HIGH


def test_one_sensor_drives_and_the_others_follow():
    driven = oak_config(sync="driven", sync_driver="left")
    assert sync_mode(driven, "left") == Mode.OUTPUT
    assert sync_mode(driven, "right") == Mode.INPUT
    assert sync_mode(oak_config(), "left") is None
    assert sync_mode(oak_config(sync="external"), "left") == Mode.INPUT
    assert sync_mode(oak_config(sync="off"), "left") == Mode.OFF
    assert sync_mode(oak_config(sync="ptp"), "left") == Mode.TIME_PTP


@pytest.mark.parametrize("name", [f"CAM_{letter}" for letter in "ABCDEFGHIJ"])
def test_every_socket_that_a_profile_can_name_exists(name: str):
    assert board_socket(name) == board_socket(f"192.168.1.7/{name}")
    assert board_socket(name).name == name


def test_the_graph_of_cameras_is_built_up_to_where_a_device_is_needed():
    """Without a device the library refuses the first camera node, and says so."""
    pipeline = dai.Pipeline(createImplicitDevice=False)
    with pytest.raises(RuntimeError, match="host only"):
        camera_outputs(pipeline, oak_config(), PAIR)


class FakeNode:
    """A camera node as far as it is told something; remembers it."""

    def __init__(self) -> None:
        self.initialControl = dai.CameraControl()
        self.raw = "raw"
        self.built: tuple[object, ...] = ()
        self.asked: dict[str, object] = {}

    def build(
        self,
        socket: dai.CameraBoardSocket,
        sensorResolution: tuple[int, int] | None = None,
        sensorFps: float | None = None,
    ) -> None:
        self.built = (socket, sensorResolution, sensorFps)

    def requestOutput(self, size: object, kind: object, **options: object) -> str:  # noqa: N802
        self.asked = {"size": size, "kind": kind, **options}
        return "grey"


class FakePipeline:
    """Makes camera nodes without a device."""

    def __init__(self) -> None:
        self.nodes: list[FakeNode] = []

    def create(self, kind: object) -> FakeNode:
        assert kind is dai.node.Camera
        self.nodes.append(FakeNode())
        return self.nodes[-1]


def cameras(config: OakCameraConfig) -> tuple[list[FakeNode], dict[str, object]]:
    pipeline = FakePipeline()
    outputs = camera_outputs(cast("dai.Pipeline", pipeline), config, config.sockets)
    return pipeline.nodes, dict(outputs)


def test_every_view_is_a_camera_node_with_locked_controls_and_its_part_in_synchronisation():
    (left, right), outputs = cameras(oak_config(sync="driven", sync_driver="right"))
    assert outputs == {"left": "grey", "right": "grey"}
    assert left.built == (board_socket("CAM_B"), None, 10.0)
    assert right.built[0] == board_socket("CAM_C")
    assert left.asked == {
        "size": (1280, 800),
        "kind": dai.ImgFrame.Type.GRAY8,
        "fps": 10.0,
        "enableUndistortion": False,
    }
    assert left.initialControl.frameSyncMode == Mode.INPUT
    assert right.initialControl.frameSyncMode == Mode.OUTPUT
    assert left.initialControl.expManual.exposureTimeUs == 8000


def test_every_socket_has_its_own_size_pixels_and_controls():
    (left, middle, right), _ = cameras(three_views())
    assert [node.asked["size"] for node in (left, middle, right)] == [
        (1280, 800),
        (1920, 1080),
        (1280, 800),
    ]
    kinds = [node.asked["kind"] for node in (left, middle, right)]
    grey, colour = dai.ImgFrame.Type.GRAY8, dai.ImgFrame.Type.NV12
    assert kinds == [grey, colour, grey]
    exposures = [node.initialControl.expManual for node in (left, middle, right)]
    assert [one.exposureTimeUs for one in exposures] == [8000, 4000, 8000]
    assert [one.sensitivityIso for one in exposures] == [100, 200, 100]
    assert middle.initialControl.lensPosition == 130
    assert middle.initialControl.wbColorTemp == 5000
    manual = dai.CameraControl.Command.AF_MODE
    assert middle.initialControl.getCommand(manual)
    assert not left.initialControl.getCommand(manual)


def test_a_sensor_is_judged_by_its_own_size_and_focus():
    config = three_views()
    require_sensors(three_features(), config, config.sockets, "OAK 1")
    free = {**config.sensors["middle"].given}
    del free["lens_position"]
    with pytest.raises(ConfigError, match=r"view middle \(IMX378\): has autofocus") as told:
        require_sensors(
            three_features(), three_views(sensors={"middle": free}), config.sockets, "OAK 1"
        )
    assert "camera.sensors.middle.lens_position" in told.value.advice
    with pytest.raises(ConfigError, match="asked for 4058 x 1080 px, the sensor has 4056 x 3040"):
        wide = three_views(sensors={"middle": {**config.sensors["middle"].given, "width_px": 4058}})
        require_sensors(three_features(), wide, config.sockets, "OAK 1")


@pytest.mark.parametrize(
    ("pixels", "width_px", "colour", "says"),
    [
        ("nv12", 1280, False, "asked for colour, the sensor is monochrome"),
        ("nv12", 1279, True, "nv12 of 1279 x 800 px, whose colour is that of squares"),
        ("nv12", 1280, True, None),
        ("gray8", 1279, True, None),
    ],
)
def test_colour_comes_from_colour_sensors_in_even_sizes(
    pixels: str, width_px: int, colour: bool, says: str | None
):
    config = oak_config(pixels=pixels, width_px=width_px)
    there = [feature(name, colour=colour) for name in ("CAM_B", "CAM_C")]
    if says is None:
        require_sensors(there, config, PAIR, "OAK 1")
        return
    with pytest.raises(ConfigError, match=says):
        require_sensors(there, config, PAIR, "OAK 1")


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        (dai.CameraSensorType.TOF, "measures times of flight, rig needs pictures of light"),
        (dai.CameraSensorType.THERMAL, "sees heat, rig needs pictures of light"),
    ],
)
def test_sensors_that_give_no_pictures_are_refused(kind: dai.CameraSensorType, says: str):
    odd = feature("CAM_C")
    odd.supportedTypes = [kind]
    with pytest.raises(ConfigError, match=says) as told:
        require_sensors([feature("CAM_B"), odd], oak_config(), PAIR, "OAK 1")
    assert told.value.advice == "take it out of camera.sockets"


@pytest.mark.parametrize("name", ["IMX378", "imx577", "AR0234"])
def test_a_sensor_that_can_only_follow_drives_nobody(name: str):
    driven = oak_config(sync="driven", sync_driver="right")
    there = [feature("CAM_B"), feature("CAM_C", name=name)]
    with pytest.raises(ConfigError, match=r"view right .*is to drive the others, such a sensor"):
        require_sensors(there, driven, PAIR, "OAK 1")
    followed = oak_config(sync="driven", sync_driver="left")
    require_sensors(there, followed, PAIR, "OAK 1")


def test_a_driver_reaches_both_lines_of_an_ffc_4p_only_where_they_are_joined():
    across = {"left": "CAM_A", "right": "CAM_B"}
    changes = {"sockets": across, "sync": "driven", "sync_driver": "left"}
    with pytest.raises(ConfigError, match="CAM_A, CAM_B, which are on two synchronisation lines"):
        require_one_sync_line("OAK-FFC-4P", oak_config(**changes), across)
    for model, config, sockets in (
        ("OAK-FFC-4P", oak_config(**changes, joins_sync_lines=True), across),
        ("OAK-FFC-4P", oak_config(sync="driven", sync_driver="left"), PAIR),
        ("OAK-FFC-4P", oak_config(sockets=across), across),
        ("OAK-FFC-3P", oak_config(**changes), across),
    ):
        require_one_sync_line(model, config, sockets)
    assert oak_config(**changes).sync_driver == "left"


@pytest.mark.parametrize(
    ("size_px", "said"),
    [
        ((1280, 800), None),
        ((640, 400), None),
        ((640, 360), "640 x 360 px of a sensor of 640 x 400 px: cut by 0 x 40 px"),
        ((320, 200), "320 x 200 px of a sensor of 640 x 400 px: scaled by 0.500"),
        ((960, 540), "960 x 540 px of a sensor of 1280 x 800 px: scaled by 0.750 cut by 0 x 60 px"),
    ],
)
def test_a_size_that_is_no_mode_of_the_sensor_is_told(size_px: tuple[int, int], said: str | None):
    assert resized(feature("CAM_B"), size_px) == said


def test_the_rate_of_unlike_sensors_is_the_sum_of_each():
    config = three_views()
    needed = needed_mb_s(config, config.sockets)
    assert needed == pytest.approx((2 * 1280 * 800 + 1.5 * 1920 * 1080) * 10 / 1e6)
    with pytest.raises(
        ConfigError,
        match=r"2 x 1280 x 800 px gray8 and 1 x 1920 x 1080 px nv12 at 10 Hz need 51\.6 MB/s",
    ):
        require_bandwidth(config, config.sockets, link="USB 2", available_mb_s=40.0, device="OAK")
    require_bandwidth(config, config.sockets, link="unknown", available_mb_s=None, device="OAK")


def test_raw_pixels_come_from_the_sensor_in_its_own_size():
    (left, _), outputs = cameras(oak_config(pixels="raw10"))
    assert outputs == {"left": "raw", "right": "raw"}
    assert left.built == (board_socket("CAM_B"), (1280, 800), 10.0)
    assert not left.initialControl.getCommand(dai.CameraControl.Command.FRAME_SYNC)


def test_sensors_that_can_keep_the_profile_pass():
    require_sensors([feature("CAM_B"), feature("CAM_C")], oak_config(), PAIR, "OAK 1")
    locked = oak_config(lens_position=130, sockets={"left": "CAM_A", "right": "CAM_C"})
    both = [feature("CAM_A", focus=True), feature("CAM_C", focus=True)]
    require_sensors(both, locked, locked.sockets, "OAK 1")
    raw = oak_config(pixels="raw10")
    require_sensors([feature("CAM_B"), feature("CAM_C")], raw, PAIR, "OAK 1")


@pytest.mark.parametrize(
    ("changes", "focus", "colour", "says"),
    [
        ({"width_px": 1920}, False, False, "asked for 1920 x 800 px, the sensor has 1280 x 800"),
        ({"rate_hz": 120.0}, False, False, None),
        ({"rate_hz": 124.9, "exposure_s": 0.001}, False, False, None),
        ({"rate_hz": 200.0, "exposure_s": 0.001}, False, False, "it reaches 129.6 Hz"),
        ({}, True, False, "lock it with camera.lens_position"),
        ({"lens_position": 9}, False, False, "has no focus motor"),
        ({"pixels": "raw10"}, False, True, "a mosaic"),
        ({"pixels": "raw10", "width_px": 640}, False, False, "its modes are 640 x 400, 1280 x 800"),
    ],
)
def test_what_a_sensor_cannot_keep_is_refused(
    changes: Mapping[str, object], focus: bool, colour: bool, says: str | None
):
    config = oak_config(**changes)
    there = [feature(name, focus=focus, colour=colour) for name in ("CAM_B", "CAM_C")]
    if says is None:
        require_sensors(there, config, PAIR, "OAK 1")
        return
    with pytest.raises(ConfigError, match=r"OAK 1, view left \(OV9282\)") as caught:
        require_sensors(there, config, PAIR, "OAK 1")
    assert says in str(caught.value)


def test_an_empty_socket_is_named_with_what_is_there():
    with pytest.raises(DeviceNotFoundError, match="sensor at CAM_C, the board finds CAM_B OV9282"):
        require_sensors([feature("CAM_B")], oak_config(), PAIR, "OAK 1")


def test_the_data_rate_is_that_of_the_bytes_on_the_wire():
    assert needed_mb_s(oak_config(), PAIR) == pytest.approx(2 * 1280 * 800 * 10 / 1e6)
    assert needed_mb_s(oak_config(pixels="raw10"), PAIR) == pytest.approx(2 * 1600 * 800 * 10 / 1e6)


def test_a_link_that_is_too_slow_is_refused_with_both_rates():
    config = oak_config(rate_hz=30.0)
    require_bandwidth(config, FOUR, link="USB 3", available_mb_s=312.0, device="OAK 1")
    with pytest.raises(ConfigError) as caught:
        require_bandwidth(config, FOUR, link="USB 2", available_mb_s=40.0, device="OAK 1")
    message = str(caught.value)
    assert "need 122.9 MB/s, USB 2 carries 40 MB/s" in message
    assert "lower camera.rate_hz to 9.8" in message
    assert "USB 3 cable" in message
