"""Sensors, links and EEPROM images at the borders of what is taken."""

import json
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest
from rig_drivers.oak.bandwidth import link_of, needed_mb_s, require_bandwidth
from rig_drivers.oak.board import require_sensors
from rig_drivers.oak.controls import Applied, Controls
from rig_drivers.oak.eeprom import first_difference
from rig_drivers.oak.eeprom_check import require_image
from rig_drivers.oak.raw10 import pack_raw10, packed_bytes, unpack_raw10
from rig_drivers.oak.sdk import dai
from rig_drivers.oak.watchdog import Watchdog

from rig.errors import ConfigError, ControlError
from tests.support.oak import feature, oak_config

PAIR = {"left": "CAM_B", "right": "CAM_C"}


def accepts(**changes: object) -> bool:
    try:
        require_sensors([feature("CAM_B"), feature("CAM_C")], oak_config(**changes), PAIR, "OAK 1")
    except ConfigError:
        return False
    return True


@pytest.mark.parametrize(
    ("changes", "is_taken"),
    [
        ({"width_px": 1280, "height_px": 800}, True),
        ({"width_px": 1281}, False),
        ({"height_px": 801}, False),
        ({"rate_hz": 129.0}, True),
        ({"rate_hz": 130.0}, False),
        ({"width_px": 640, "height_px": 400, "rate_hz": 255.0}, True),
        ({"width_px": 640, "height_px": 401, "rate_hz": 255.0}, False),
        ({"width_px": 641, "height_px": 400, "rate_hz": 255.0}, False),
        ({"width_px": 640, "height_px": 400, "rate_hz": 256.0}, False),
        ({"pixels": "raw10", "width_px": 640, "height_px": 400}, True),
        ({"pixels": "raw10", "width_px": 640, "height_px": 398}, False),
    ],
)
def test_a_sensor_keeps_its_own_sizes_and_the_rates_of_each(
    changes: dict[str, object], is_taken: bool
):
    assert accepts(exposure_s=0.0005, **changes) == is_taken


@dataclass
class FakeLink:
    """A device as far as its link is concerned."""

    protocol: dai.XLinkProtocol
    speed: dai.UsbSpeed

    def getProtocol(self) -> dai.XLinkProtocol:  # noqa: N802
        return self.protocol

    def getUsbSpeed(self) -> dai.UsbSpeed:  # noqa: N802
        return self.speed


@pytest.mark.parametrize(
    ("protocol", "speed", "link"),
    [
        (dai.XLinkProtocol.X_LINK_TCP_IP, dai.UsbSpeed.SUPER, ("gigabit Ethernet", 99.0)),
        (dai.XLinkProtocol.X_LINK_USB_VSC, dai.UsbSpeed.SUPER, ("USB 3", 312.0)),
        (dai.XLinkProtocol.X_LINK_USB_VSC, dai.UsbSpeed.SUPER_PLUS, ("USB 3", 312.0)),
        (dai.XLinkProtocol.X_LINK_USB_VSC, dai.UsbSpeed.HIGH, ("USB 2", 40.0)),
        (dai.XLinkProtocol.X_LINK_USB_VSC, dai.UsbSpeed.FULL, ("USB at FULL speed", 1.0)),
    ],
)
def test_a_link_has_a_name_and_a_rate(
    protocol: dai.XLinkProtocol, speed: dai.UsbSpeed, link: tuple[str, float]
):
    assert link_of(cast("dai.DeviceBase", FakeLink(protocol, speed))) == link


def test_a_link_that_is_just_fast_enough_is_taken():
    config = oak_config()
    needed = needed_mb_s(config, PAIR)
    assert needed == 20.48
    require_bandwidth(config, PAIR, link="USB 2", available_mb_s=needed, device="OAK 1")
    with pytest.raises(ConfigError) as caught:
        require_bandwidth(config, PAIR, link="USB 3", available_mb_s=10.24, device="OAK 1")
    assert "2 x 1280 x 800 px gray8 at 10 Hz need 20.5 MB/s, USB 3 carries 10" in str(caught.value)
    assert "lower camera.rate_hz to 5.0 or the size" in str(caught.value)
    assert "cable" not in str(caught.value)


@pytest.mark.parametrize(
    ("asked_s", "within_s", "beyond_s"),
    [(0.001, 0.00104, 0.00106), (0.001, 0.00096, 0.00094), (0.010, 0.01019, 0.01021)],
)
def test_exposures_may_differ_by_two_percent_or_fifty_microseconds(
    asked_s: float, within_s: float, beyond_s: float
):
    controls = Controls(asked_s, 100, None, None)
    controls.require(Applied(within_s, 100, -1, 0), "camera")
    with pytest.raises(ControlError):
        controls.require(Applied(beyond_s, 100, -1, 0), "camera")


def test_times_and_gains_are_written_in_the_sensors_units():
    control = dai.CameraControl()
    Controls(0.0012345, 400, 0, 2500).set_on(control)
    assert control.expManual.exposureTimeUs == 1234
    assert (control.lensPosition, control.wbColorTemp) == (0, 2500)
    with pytest.raises(ControlError, match="the camera applies 1"):
        Controls(0.01, 100, 5, None).require(Applied(0.01, 100, 1, 0), "camera")
    with pytest.raises(ControlError, match="the camera applies nothing"):
        Controls(0.01, 100, 5, None).require(Applied(0.01, 100, 0, 0), "camera")


def image(sockets: tuple[int, ...] = (0, 9), towards: tuple[int, ...] = (-1, 0)) -> dict[str, Any]:
    """Sensors as an EEPROM holds them; the pose of each refers to the socket in `towards`."""

    def sensor(target: int) -> dict[str, Any]:
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        return {
            "intrinsicMatrix": [[800.0, 0.0, 640.0], [0.0, 800.0, 400.0], [0.0, 0.0, 1.0]],
            "width": 1280,
            "height": 800,
            "distortionCoeff": [0.0] * 14,
            "extrinsics": {
                "translation": dict(zero),
                "specTranslation": dict(zero),
                "toCameraSocket": target,
                "rotationMatrix": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            },
        }

    pairs = zip(sockets, towards, strict=True)
    return {"cameraData": [[socket, sensor(target)] for socket, target in pairs]}


def with_value(path: tuple[str | int, ...], value: object) -> dict[str, Any]:
    content: Any = json.loads(json.dumps(image()))
    node = content["cameraData"][1]
    for step in path[:-1]:
        node = node[step]
    node[path[-1]] = value
    return content


@pytest.mark.parametrize(
    ("sockets", "towards"),
    [((0,), (-1,)), ((0, 9), (-1, 0)), ((0, 1, 2, 3), (1, 2, 3, -1)), ((3, 1, 2), (-1, 3, 1))],
)
def test_sensors_that_refer_to_each_other_in_a_row_are_taken(
    sockets: tuple[int, ...], towards: tuple[int, ...]
):
    content = image(sockets, towards)
    require_image(content)
    assert len(content["cameraData"]) == len(sockets)


@pytest.mark.parametrize(
    ("sockets", "towards", "says"),
    [
        ((10,), (-1,), "socket 10, which is none"),
        ((1, 1), (-1, -1), "socket 1, which is none or came before"),
        ((0,), (0,), "in a circle"),
        ((0, 1), (1, 0), "in a circle"),
        ((0, 1, 2), (1, 2, 1), "in a circle"),
        ((0, 1), (-1, 4), "towards socket 4, which is not there"),
        ((0, 1), (-1, -2), "toCameraSocket is no whole number from -1 on"),
        ((-1,), (-1,), "is no whole number from 0 on"),
    ],
)
def test_sensors_that_do_not_are_refused(
    sockets: tuple[int, ...], towards: tuple[int, ...], says: str
):
    with pytest.raises(ConfigError, match=says):
        require_image(image(sockets, towards))


@pytest.mark.parametrize(
    ("path", "taken", "refused"),
    [
        ((1, "width"), 1, 0),
        ((1, "height"), 1, 0),
        ((1, "width"), 2**31 - 1, 2**31),
        ((1, "height"), 4, True),
        ((1, "height"), 4, 4.0),
        ((1, "distortionCoeff"), [0.0] * 14, [0.0] * 15),
        ((1, "distortionCoeff"), [], None),
        ((1, "distortionCoeff", 3), 9e29, 1e30),
        ((1, "distortionCoeff", 3), -9e29, -1e30),
        ((1, "distortionCoeff", 3), 1, True),
        ((1, "intrinsicMatrix", 0, 0), 0.001, 0.0),
        ((1, "intrinsicMatrix", 1, 1), 0.001, 0.0),
        ((1, "intrinsicMatrix", 0, 1), 0.0, float("inf")),
        ((1, "extrinsics", "translation", "x"), 0.0, "0"),
        ((1, "extrinsics", "translation", "z"), 0.0, None),
        ((1, "extrinsics", "specTranslation", "y"), -2.0, [1.0]),
        ((1, "extrinsics", "toCameraSocket"), -1, 9),
        ((1, "extrinsics", "rotationMatrix"), [[0.0] * 3] * 3, [[0.0] * 3] * 2),
        ((1, "extrinsics", "rotationMatrix"), [[0.0] * 3] * 3, [[0.0] * 4, [0.0] * 3, [0.0] * 2]),
        ((1, "extrinsics"), image()["cameraData"][0][1]["extrinsics"], None),
    ],
)
def test_a_value_is_taken_up_to_its_border(
    path: tuple[str | int, ...], taken: object, refused: object
):
    require_image(with_value(path, taken))
    with pytest.raises(ConfigError, match=r"no calibration of an OAK device: cameraData"):
        require_image(with_value(path, refused))


def test_a_sensor_without_a_pose_needs_no_rotation_and_one_with_a_pose_does():
    content = image()
    del content["cameraData"][0][1]["extrinsics"]["rotationMatrix"]
    require_image(content)
    del content["cameraData"][1][1]["extrinsics"]["rotationMatrix"]
    with pytest.raises(ConfigError, match=r"cameraData\[1\].*rotationMatrix is no 3 x 3"):
        require_image(content)


@pytest.mark.parametrize(
    ("one", "other", "place"),
    [
        ({"a": 1}, {"a": 1}, None),
        ({"a": 1}, {"a": 2}, "a (1, 2 found)"),
        ({"a": {"b": 1}}, {"a": {"b": 1, "c": 2}}, "a.c (None, 2 found)"),
        ({"a": [1, 2]}, {"a": [1]}, "a (2 entries, 1 found)"),
        ({"a": [1, 2]}, {"a": [1, 3]}, "a[1] (2, 3 found)"),
        ({"a": [[0], [1]]}, {"a": [[0], [2]]}, "a[1][0] (1, 2 found)"),
        ({"b": 1, "a": 1}, {"b": 2, "a": 2}, "a (1, 2 found)"),
        (1000.0, 1000.009, None),
        (1000.0, 1000.011, " (1000.0, 1000.011 found)"),
        (1.0, 1, None),
        (0.0, 0.9e-5, None),
        (0.0, 1.1e-5, " (0.0, 1.1e-05 found)"),
        (0.0, "0", " (0.0, '0' found)"),
        ({"a": 1}, [1], " ({'a': 1}, [1] found)"),
        ([1], {"a": 1}, " ([1], {'a': 1} found)"),
    ],
)
def test_the_first_difference_is_told_with_its_place(one: object, other: object, place: str | None):
    assert first_difference(one, other) == place


@pytest.mark.parametrize(("width_px", "filled"), [(1, 5), (4, 5), (5, 10), (1280, 1600)])
def test_four_pixels_fill_five_bytes(width_px: int, filled: int):
    assert packed_bytes(width_px) == filled


def test_raw_rows_may_be_as_short_as_they_are_and_no_shorter():
    picture = np.arange(16, dtype=np.uint16).reshape(2, 8)
    data = pack_raw10(picture)
    assert data.size == 20
    again = unpack_raw10(data, width_px=8, height_px=2, stride=10)
    np.testing.assert_array_equal(again, picture)
    with pytest.raises(ValueError, match="8 px fills 10 bytes, rows are 9 apart"):
        unpack_raw10(data, width_px=8, height_px=2, stride=9)
    with pytest.raises(ValueError, match="8 x 2 px in RAW10 fill 20 bytes, found 19"):
        unpack_raw10(data[:-1], width_px=8, height_px=2)
    with pytest.raises(ValueError, match="8 x 2 px in RAW10 fill 21 bytes, found 20"):
        unpack_raw10(data, width_px=8, height_px=2, stride=11)


def test_ten_bits_end_at_1023():
    assert pack_raw10(np.array([[1023, 0, 0, 0]], np.uint16)).tolist() == [255, 0, 0, 0, 3]
    with pytest.raises(ValueError, match="found 1024"):
        pack_raw10(np.array([[0, 1024]], np.uint16))


def test_a_frame_begun_at_the_very_time_is_no_silence():
    watchdog = Watchdog(("left", "right"))
    watchdog.saw("left", start_s=1.0, middle_s=1.5)
    watchdog.saw("right", start_s=0.75, middle_s=1.25)
    assert watchdog.silent_since(1.0) == ("right",)
    assert watchdog.silent_since(0.75) == ()
    watchdog.saw("left", start_s=9.0, middle_s=1.5)
    assert watchdog.silent_since(2.0) == ("left", "right"), "the same frame again is no news"
    assert watchdog.phase_s(1.0) == 0.25
    assert Watchdog(()).phase_s(1.0) == 0.0
