"""What is done to a device between opening it and its first frame, on a stand-in for the device."""

import json
import logging
from typing import cast

import pytest
from rig_drivers.oak.bandwidth import link_of
from rig_drivers.oak.device_sensors import DeviceSensors, prepare_device
from rig_drivers.oak.sdk import dai

from rig.errors import ConfigError, DeviceLostError, DeviceNotFoundError
from rig.factory import CALIBRATION_SHA256
from tests.support.oak import oak_config, oak_d, three_features, three_views

PAIR = {"left": "CAM_B", "right": "CAM_C"}


class FakeDevice:
    """An OAK-D Pro as far as it is asked here; remembers what it was told."""

    def __init__(
        self, speed: dai.UsbSpeed = dai.UsbSpeed.SUPER, *, by_network: bool = False
    ) -> None:
        self.told: list[tuple[str, object]] = []
        self._speed = speed
        self._by_network = by_network

    def getDeviceId(self) -> str:  # noqa: N802
        return "18443010D1E5A70F00"

    def getProductName(self) -> str:  # noqa: N802
        return "OAK-D-PRO"

    def getProtocol(self) -> dai.XLinkProtocol:  # noqa: N802
        protocol = dai.XLinkProtocol
        return protocol.X_LINK_TCP_IP if self._by_network else protocol.X_LINK_USB_VSC

    def getUsbSpeed(self) -> dai.UsbSpeed:  # noqa: N802
        return self._speed

    def getIrDrivers(self) -> list[tuple[str, int, int]]:  # noqa: N802
        return [("LM3644", 2, 0x63)]

    def getConnectedCameraFeatures(self) -> list[dai.CameraFeatures]:  # noqa: N802
        return three_features()

    def readCalibration(self) -> dai.CalibrationHandler:  # noqa: N802
        return oak_d()

    def setMaxReconnectionAttempts(self, attempts: int) -> None:  # noqa: N802
        self.told.append(("reconnections", attempts))

    def setLogLevel(self, level: dai.LogLevel) -> None:  # noqa: N802
        self.told.append(("log", level))

    def setLogOutputLevel(self, level: dai.LogLevel) -> None:  # noqa: N802
        self.told.append(("log on stdout", level))

    def addLogCallback(self, callback: object) -> int:  # noqa: N802
        self.told.append(("callback", callback))
        return 0

    def setIrLaserDotProjectorIntensity(self, intensity: float) -> bool:  # noqa: N802
        self.told.append(("dots", intensity))
        return True

    def setIrFloodLightIntensity(self, intensity: float) -> bool:  # noqa: N802
        self.told.append(("flood", intensity))
        return True


def as_device(fake: FakeDevice) -> dai.Device:
    return cast("dai.Device", fake)


def test_a_device_is_made_quiet_and_dark_and_does_not_restart_by_itself():
    fake = FakeDevice()
    prepare_device(as_device(fake), oak_config(), PAIR)
    told = dict(fake.told)
    assert told["reconnections"] == 0
    assert told["log on stdout"] == dai.LogLevel.OFF
    assert told["dots"] == 0.0
    assert told["flood"] == 0.0


def test_its_identity_holds_link_sensors_and_calibration():
    identity = prepare_device(as_device(FakeDevice()), oak_config(), PAIR)
    assert identity["serial"] == "18443010D1E5A70F00"
    assert identity["link"] == "USB 3"
    assert identity["sensor CAM_C"] == "OV9282"
    calibration = json.loads(identity["calibration CAM_C"])
    assert calibration["translation_mm"] == [75.0, 0.0, 0.0]


def test_a_slow_link_is_refused_before_anything_flows():
    fast = oak_config(rate_hz=30.0)
    with pytest.raises(ConfigError, match=r"OAK 18443010D1E5A70F00.*USB 2 carries 40 MB/s"):
        prepare_device(as_device(FakeDevice(dai.UsbSpeed.HIGH)), fast, PAIR)
    prepare_device(as_device(FakeDevice(by_network=True)), fast, PAIR)


@pytest.mark.parametrize(
    ("fake", "link"),
    [
        (FakeDevice(dai.UsbSpeed.SUPER_PLUS), ("USB 3", 312.0)),
        (FakeDevice(dai.UsbSpeed.FULL), ("USB at FULL speed", 1.0)),
        (FakeDevice(dai.UsbSpeed.UNKNOWN, by_network=True), ("gigabit Ethernet", 99.0)),
    ],
)
def test_every_link_has_a_name_and_a_rate(fake: FakeDevice, link: tuple[str, float]):
    assert link_of(as_device(fake)) == link


@pytest.mark.parametrize(
    ("protocol", "name"),
    [
        (dai.XLinkProtocol.X_LINK_LOCAL_SHDMEM, "no cable"),
        (dai.XLinkProtocol.X_LINK_TCP_IP_OR_LOCAL_SHDMEM, "no cable"),
        (dai.XLinkProtocol.X_LINK_USB_VSC, "a link of unknown speed"),
    ],
)
def test_a_link_of_unknown_speed_is_not_taken_for_a_slow_one(
    protocol: dai.XLinkProtocol, name: str
):
    fake = FakeDevice(dai.UsbSpeed.UNKNOWN)
    fake.getProtocol = lambda: protocol
    assert link_of(as_device(fake)) == (name, None)
    identity = prepare_device(as_device(fake), oak_config(rate_hz=120.0), PAIR)
    assert identity["link"] == name


def test_flood_light_is_a_wish_and_dots_are_never_on():
    fake = FakeDevice()
    prepare_device(as_device(fake), oak_config(ir_flood_share=0.4), PAIR)
    told = dict(fake.told)
    assert (told["flood"], told["dots"]) == (0.4, 0.0)


@pytest.mark.parametrize("has_drivers", [False, True])
def test_flood_light_that_is_not_there_is_refused(has_drivers: bool):
    fake = FakeDevice()
    fake.getIrDrivers = lambda: [("LM3644", 2, 0x63)] if has_drivers else []
    fake.setIrFloodLightIntensity = lambda intensity: intensity == 0.0
    with pytest.raises(ConfigError, match=r"infrared flood light of 0\.4, it has none"):
        prepare_device(as_device(fake), oak_config(ir_flood_share=0.4), PAIR)
    prepare_device(as_device(fake), oak_config(), PAIR)


def test_the_hash_of_its_calibration_changes_with_the_calibration_alone():
    fake = FakeDevice()
    first = prepare_device(as_device(fake), oak_config(), PAIR)
    again = prepare_device(as_device(FakeDevice()), oak_config(rate_hz=20.0), PAIR)
    assert len(first[CALIBRATION_SHA256]) == 64
    assert again[CALIBRATION_SHA256] == first[CALIBRATION_SHA256]
    board = oak_d()
    board.setBoardInfo("OAK-D", "R2")
    fake.readCalibration = lambda: board
    renamed = prepare_device(as_device(fake), oak_config(), PAIR)
    assert renamed[CALIBRATION_SHA256] == first[CALIBRATION_SHA256]
    fake.readCalibration = lambda: oak_d(focal_px=800.5)
    changed = prepare_device(as_device(fake), oak_config(), PAIR)
    assert changed[CALIBRATION_SHA256] != first[CALIBRATION_SHA256]


def test_the_three_cameras_of_an_oak_d_are_one_rig(caplog: pytest.LogCaptureFixture):
    config = three_views()
    with caplog.at_level(logging.WARNING):
        identity = prepare_device(as_device(FakeDevice()), config, config.sockets)
    assert identity["sensor CAM_A"] == "IMX378"
    assert not [key for key in identity if key.startswith("size ")]
    assert caplog.text == ""


def test_pictures_that_are_scaled_or_cut_are_told(caplog: pytest.LogCaptureFixture):
    half = {**three_views().sensors["middle"].given, "width_px": 960, "height_px": 600}
    config = three_views(sensors={"middle": half})
    with caplog.at_level(logging.WARNING):
        identity = prepare_device(as_device(FakeDevice()), config, config.sockets)
    # 600 of 1080 lines: 1920 columns become 1066.7, of which 960 are kept.
    said = "960 x 600 px of a sensor of 1920 x 1080 px: scaled by 0.556 cut by 107 x 0 px"
    assert identity["size CAM_A"] == said
    assert f"view middle: {said}" in caplog.text


def test_the_log_of_a_device_reaches_ours(caplog: pytest.LogCaptureFixture):
    fake = FakeDevice()
    prepare_device(as_device(fake), oak_config(), PAIR)
    callback = dict(fake.told)["callback"]
    assert callable(callback)

    class Message:
        nodeIdName, payload = "Camera", "sensor restarted"  # noqa: N815

    with caplog.at_level(logging.WARNING):
        callback(Message())
    assert "Camera: sensor restarted" in caplog.text


@pytest.mark.slow
def test_no_device_is_an_error_of_ours_and_a_closed_one_gives_nothing():
    sensors = DeviceSensors(oak_config(), "184430", PAIR)
    with pytest.raises(DeviceNotFoundError, match="asked for 184430, found"):
        sensors.__enter__()
    with pytest.raises(DeviceLostError, match="not open"):
        sensors.pipeline()
    assert sensors.identity["kind"] == "oak"
    assert sensors.failure() is not None


def test_its_own_calibration_is_read_from_the_open_device_and_missed_without():
    sensors = DeviceSensors(oak_config(width_px=640, height_px=400), "", PAIR)
    with pytest.raises(DeviceLostError, match="is not open"):
        _ = sensors.factory_calibration
    sensors._device = as_device(FakeDevice())
    known = sensors.factory_calibration
    assert known is not None
    assert [camera.view for camera in known] == ["left", "right"]
    assert known[0].matrix_px[0][0] == pytest.approx(400.0)

    class Broken(FakeDevice):
        def readCalibration(self) -> dai.CalibrationHandler:  # noqa: N802
            raise RuntimeError("X_LINK_ERROR")

    sensors._device = as_device(Broken())
    with pytest.raises(DeviceLostError, match="does not tell its calibration"):
        _ = sensors.factory_calibration
