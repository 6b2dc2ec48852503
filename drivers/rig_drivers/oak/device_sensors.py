"""Sensors of a real device."""

import logging
from collections.abc import Mapping, Sequence
from typing import Self

from rig.errors import ConfigError, DeviceLostError
from rig.factory import CALIBRATION_SHA256, FactoryCamera
from rig.profile import OakCameraConfig
from rig_drivers.oak.bandwidth import link_of, require_bandwidth
from rig_drivers.oak.board import (
    board_socket,
    camera_outputs,
    device_config,
    require_one_sync_line,
    require_sensors,
    resized,
)
from rig_drivers.oak.calibration import calibration_fields, factory_cameras
from rig_drivers.oak.discovery import open_oak
from rig_drivers.oak.eeprom import calibration_sha256
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
        sizes_px = {view: self._config.size_of(view) for view in self._sockets}
        try:
            return factory_cameras(self._opened().readCalibration(), self._sockets, sizes_px)
        except RuntimeError as error:
            raise DeviceLostError(
                self.name,
                f"does not tell its calibration ({error})",
                advice="plug it in again",
            ) from error

    def pipeline(self) -> dai.Pipeline:
        """See `Sensors.pipeline`; the library must not touch the device's calibration by itself.

        How it would have done so is kept in the identity.
        """
        pipeline = dai.Pipeline(self._opened())
        before = pipeline.getAutoCalibrationMode()
        pipeline.setAutoCalibrationMode(dai.Pipeline.AutoCalibrationMode.OFF)
        self._identity["automatic calibration"] = f"{before.name}, switched off"
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
    _set_lights(device, config, name)
    features = device.getConnectedCameraFeatures()
    require_sensors(features, config, sockets, name)
    model = str(device.getProductName() or device.getDeviceName())
    require_one_sync_line(model, config, sockets)
    link, available_mb_s = link_of(device)
    require_bandwidth(config, sockets, link=link, available_mb_s=available_mb_s, device=name)
    handler = device.readCalibration()
    return {
        "kind": "oak",
        "model": model,
        "serial": device.getDeviceId(),
        "depthai": dai.__version__,
        "link": link,
        **{f"sensor {feature.socket.name}": feature.sensorName for feature in features},
        **_resized(features, config, sockets, name),
        **calibration_fields(handler, sockets.values()),
        CALIBRATION_SHA256: calibration_sha256(handler),
    }


def _set_lights(device: dai.Device, config: OakCameraConfig, name: str) -> None:
    flood_share = config.ir_flood_share
    if device.getIrDrivers():
        device.setIrLaserDotProjectorIntensity(0.0)  # dots would be taken for corners of the board
        if device.setIrFloodLightIntensity(flood_share) or flood_share == 0.0:
            return
    elif flood_share == 0.0:
        return
    raise ConfigError(
        f"{name}: asked for infrared flood light of {flood_share:g}, it has none or refuses it",
        advice="remove camera.ir_flood_share; the Pro models have one",
    )


def _resized(
    features: Sequence[dai.CameraFeatures],
    config: OakCameraConfig,
    sockets: Mapping[str, str],
    name: str,
) -> dict[str, str]:
    """Say which pictures are scaled or cut: in the identity, and to whoever looks on."""
    by_socket = {feature.socket: feature for feature in features}
    found: dict[str, str] = {}
    for view, socket in sockets.items():
        said = resized(by_socket[board_socket(socket)], config.size_of(view))
        if said is not None:
            found[f"size {board_socket(socket).name}"] = said
            _log.warning("%s, view %s: %s", name, view, said)
    return found


def _log_message(message: dai.LogMessage) -> None:
    """Called on a thread of the library."""
    _log.warning("%s: %s", message.nodeIdName, message.payload)
