"""What an open OAK device tells of its sensors: their sockets, pictures and places."""

from collections.abc import Mapping

from rig.errors import ConfigError
from rig_drivers.oak.answer import SensorAnswer
from rig_drivers.oak.board import NO_PICTURES
from rig_drivers.oak.calibration import sensor_calibrations
from rig_drivers.oak.sdk import dai

Place = tuple[float, float, float]


def described_sensors(device: dai.Device) -> list[SensorAnswer]:
    """Return the sensors that give pictures of light, in the order of their sockets.

    Raises:
        RuntimeError: the device stopped answering.
    """
    features = sorted(device.getConnectedCameraFeatures(), key=lambda feature: feature.socket.name)
    features = [one for one in features if not set(one.supportedTypes) & set(NO_PICTURES)]
    places = _places_mm(device.readCalibration(), [one.socket.name for one in features])
    return [
        SensorAnswer(
            socket=one.socket.name,
            name=one.sensorName,
            sizes_px=tuple((mode.width, mode.height) for mode in one.configs)
            or ((one.width, one.height),),
            has_colour=dai.CameraSensorType.COLOR in one.supportedTypes,
            has_autofocus=one.hasAutofocus,
            place_mm=places.get(one.socket.name),
        )
        for one in features
    ]


def _places_mm(handler: dai.CalibrationHandler, sockets: list[str]) -> Mapping[str, Place]:
    """Return the optical centres, mm, by socket; nothing where one of them is not known."""
    try:
        found = sensor_calibrations(handler, sockets)
    except ConfigError:
        return {}
    return {sensor.socket: _triple(sensor.translation_mm) for sensor in found}


def _triple(numbers: tuple[float, ...]) -> Place:
    x, y, z = numbers
    return x, y, z
