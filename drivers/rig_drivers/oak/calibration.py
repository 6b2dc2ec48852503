"""What a device's EEPROM says about its sensors, in millimetres."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import cast

from rig.errors import ConfigError
from rig.factory import FactoryCamera
from rig_drivers.oak.board import board_socket
from rig_drivers.oak.sdk import dai

_MM = dai.LengthUnit.MILLIMETER


@dataclass(frozen=True, slots=True)
class SensorCalibration:
    """What the EEPROM says about one sensor."""

    socket: str
    width_px: int
    height_px: int
    camera_matrix_px: tuple[tuple[float, ...], ...]
    """3 x 3, for the full size above."""
    distortion: tuple[float, ...]
    """OpenCV's order: k1, k2, p1, p2, k3, ..."""
    model: str
    """`PERSPECTIVE` or `FISHEYE`."""
    towards: str
    """Socket of the sensor that the pose refers to, which is this one where it is the origin."""
    rotation: tuple[tuple[float, ...], ...]
    """3 x 3, turns directions of this sensor's frame into that one's."""
    translation_mm: tuple[float, ...]
    """This sensor's optical centre in that one's frame."""


def sensor_calibrations(
    handler: dai.CalibrationHandler, sockets: Iterable[str]
) -> tuple[SensorCalibration, ...]:
    """Read the calibration of some sensors; lengths, which the EEPROM keeps in cm, become mm.

    Poses refer to the first socket.

    Raises:
        ConfigError: a socket has no calibration, or is not linked with the first one.
    """
    names = list(sockets)
    return tuple(_sensor(handler, name, names[0]) for name in names)


def factory_cameras(
    handler: dai.CalibrationHandler,
    sockets: Mapping[str, str],
    sizes_px: Mapping[str, tuple[int, int]],
) -> tuple[FactoryCamera, ...] | None:
    """Return what the EEPROM says of the sensors of a rig, for pictures of the rig's sizes.

    A device makes smaller pictures by scaling its sensor's, cut about the middle where the shape is
    another.

    Args:
        handler: of the device.
        sockets: by view name, the first is what places refer to.
        sizes_px: by view name, width and height of its pictures.

    Returns:
        None where it holds no calibration of one of them.
    """
    try:
        sensors = sensor_calibrations(handler, sockets.values())
    except ConfigError:
        return None
    return tuple(
        FactoryCamera(
            view,
            *sizes_px[view],
            _scaled(sensor, sizes_px[view]),
            sensor.distortion,
            sensor.model.upper() == "FISHEYE",
            sensor.rotation,
            sensor.translation_mm,
        )
        for view, sensor in zip(sockets, sensors, strict=True)
    )


def _scaled(sensor: SensorCalibration, size_px: tuple[int, int]) -> tuple[tuple[float, ...], ...]:
    """The camera matrix of smaller pictures; pixel centres are at integers in both."""
    (fx, skew, cx), (_, fy, cy), last = sensor.camera_matrix_px
    width_px, height_px = size_px
    scale = max(width_px / sensor.width_px, height_px / sensor.height_px)
    cut_x_px = (sensor.width_px * scale - width_px) / 2.0
    cut_y_px = (sensor.height_px * scale - height_px) / 2.0
    return (
        (fx * scale, skew * scale, (cx + 0.5) * scale - 0.5 - cut_x_px),
        (0.0, fy * scale, (cy + 0.5) * scale - 0.5 - cut_y_px),
        last,
    )


def calibration_fields(handler: dai.CalibrationHandler, sockets: Iterable[str]) -> dict[str, str]:
    """Return the calibration of some sensors as fields of an identity, one JSON text each."""
    fields: dict[str, str] = {}
    names = list(sockets)
    for name in names:
        try:
            content = json.dumps(_rounded(asdict(_sensor(handler, name, names[0]))))
        except ConfigError:
            content = "none"
        fields[f"calibration {name.rpartition('/')[2]}"] = content
    return fields


def _sensor(handler: dai.CalibrationHandler, name: str, first: str) -> SensorCalibration:
    socket, origin = board_socket(name), board_socket(first)
    try:
        matrix, width, height = handler.getDefaultIntrinsics(socket)
        identity = [[float(i == k) for k in range(4)] for i in range(4)]
        pose = (
            identity if socket == origin else handler.getCameraExtrinsics(socket, origin, unit=_MM)
        )
        return SensorCalibration(
            socket.name,
            width,
            height,
            tuple(tuple(row) for row in matrix),
            tuple(handler.getDistortionCoefficients(socket)),
            handler.getDistortionModel(socket).name,
            origin.name,
            tuple(tuple(row[:3]) for row in pose[:3]),
            tuple(row[3] for row in pose[:3]),
        )
    except RuntimeError as error:
        raise ConfigError(
            f"the device holds no calibration of {name}: {error}",
            advice="calibrate with rig calibrate",
        ) from error


def _rounded(value: object) -> object:
    """Return nested data with every number at the precision that the EEPROM has."""
    match value:
        case float():
            return float(f"{value:.7g}")
        case dict():
            return {k: _rounded(v) for k, v in cast("dict[str, object]", value).items()}
        case tuple() | list():
            return [_rounded(item) for item in cast("list[object]", value)]
        case _:
            return value
