"""Sensors of a real device."""

import logging
from collections.abc import Mapping, Sequence
from typing import Self

from rig.errors import DeviceLostError
from rig.factory import FactoryCamera
from rig.profile import OakCameraConfig
from rig_drivers.oak.bandwidth import link_of, require_bandwidth
from rig_drivers.oak.board import camera_outputs, device_config, require_sensors
from rig_drivers.oak.calibration import calibration_fields, factory_cameras
from rig_drivers.oak.discovery import open_oak
from rig_drivers.oak.sdk import dai

_log = logging.getLogger(__name__)


class DeviceSensors:
    """Keeps `Sensors`; every check is done before the first frame flows.

    Args:
        config: the profile's camera.
        device: id or address of the device, empty for the only one.
        sockets: by view name, of this device.
    """

    def __init__(self, config: OakCameraConfig, device: str, sockets: Mapping[str, str]) -> None:
        self._config = config
        self._wanted = device
        self._sockets = dict(sockets)
        self._device: dai.Device | None = None
        self._identity: dict[str, str] = {"kind": "oak", "model": "not open", "serial": device}

    def __enter__(self) -> Self:
        self._device = open_oak(self._wanted, device_config(self._config))
        try:
            self._identity = prepare_device(self._device, self._config, self._sockets)
        except RuntimeError as error:
            self._close()
            raise DeviceLostError(
                self.name,
                f"stopped answering while it was prepared ({error})",
                advice="plug it in again",
            ) from error
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    @property
    def name(self) -> str:
        """See `Sensors.name`."""
        return f"OAK {self._identity['serial']}".rstrip()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Sensors.identity`; with link, sensors, and the factory calibration in mm."""
        return dict(self._identity)

    @property
    def factory_calibration(self) -> Sequence[FactoryCamera] | None:
        """See `Sensors.factory_calibration`: what its EEPROM holds.

        Raises:
            DeviceLostError: it is not open, or stopped answering.
        """
        size_px = self._config.width_px, self._config.height_px
        try:
            return factory_cameras(self._opened().readCalibration(), self._sockets, size_px)
        except RuntimeError as error:
            raise DeviceLostError(
                self.name,
                f"does not tell its calibration ({error})",
                advice="plug it in again",
            ) from error

    def pipeline(self) -> dai.Pipeline:
        """See `Sensors.pipeline`; the library must not touch the device's calibration by itself."""
        pipeline = dai.Pipeline(self._opened())
        pipeline.setAutoCalibrationMode(dai.Pipeline.AutoCalibrationMode.OFF)
        return pipeline

    def outputs(self, pipeline: dai.Pipeline) -> dict[str, dai.Node.Output]:
        """See `Sensors.outputs`."""
        return camera_outputs(pipeline, self._config, self._sockets)

    def temperature_degc(self) -> float | None:
        """See `Sensors.temperature_degc`: mean of the chip's thermometers."""
        try:
            return self._opened().getChipTemperature().average
        except RuntimeError:  # boards without a thermometer, and links that break: frames tell
            return None

    def failure(self) -> str | None:
        """See `Sensors.failure`."""
        device = self._device
        if device is None or device.isClosed():
            return "the link to the device is closed; check cable and power"
        return "the device has crashed" if device.hasCrashed() else None

    def _opened(self) -> dai.Device:
        if self._device is None:
            raise DeviceLostError(self.name, "is not open", advice='use "with camera:"')
        return self._device

    def _close(self) -> None:
        device, self._device = self._device, None
        if device is not None:
            device.close()


def prepare_device(
    device: dai.Device, config: OakCameraConfig, sockets: Mapping[str, str]
) -> dict[str, str]:
    """Check an open device against the profile, and make it quiet and dark.

    Args:
        device: just opened.
        config: the profile's camera.
        sockets: by view name, of this device.

    Returns:
        Its identity: model, id, link, sensors, and its own calibration in mm.

    Raises:
        DeviceNotFoundError: a socket is empty.
        ConfigError: a sensor or the link cannot keep the profile.
        RuntimeError: the device does not answer.
    """
    name = f"OAK {device.getDeviceId()}"
    device.setMaxReconnectionAttempts(0)  # it would start anew under a running measurement
    device.setLogLevel(dai.LogLevel.WARN)
    device.setLogOutputLevel(dai.LogLevel.OFF)
    device.addLogCallback(_log_message)
    if device.getIrDrivers():  # dots on the board would be taken for its corners
        device.setIrLaserDotProjectorIntensity(0.0)
        device.setIrFloodLightIntensity(0.0)
    features = device.getConnectedCameraFeatures()
    require_sensors(features, config, sockets, name)
    link, available_mb_s = link_of(device)
    require_bandwidth(config, len(sockets), link=link, available_mb_s=available_mb_s, device=name)
    return {
        "kind": "oak",
        "model": str(device.getProductName() or device.getDeviceName()),
        "serial": device.getDeviceId(),
        "depthai": dai.__version__,
        "link": link,
        **{f"sensor {feature.socket.name}": feature.sensorName for feature in features},
        **calibration_fields(device.readCalibration(), sockets.values()),
    }


def _log_message(message: dai.LogMessage) -> None:
    """Called on a thread of the library."""
    _log.warning("%s: %s", message.nodeIdName, message.payload)
