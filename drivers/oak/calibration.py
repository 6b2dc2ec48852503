"""The calibration in a device's EEPROM: read in millimetres; written only on purpose."""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Protocol, cast

from drivers.oak.board import board_socket
from drivers.oak.sdk import dai
from rig.errors import ConfigError, DeviceLostError

_MM = dai.LengthUnit.MILLIMETER
_ROUNDING = 1e-5
"""The EEPROM holds single-precision numbers."""


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


class EepromDevice(Protocol):
    """What is used of an open `depthai.Device` for its calibration."""

    def getDeviceId(self) -> str:  # noqa: N802
        """Return its id (MxId)."""
        ...

    def readCalibration2(self) -> dai.CalibrationHandler:  # noqa: N802
        """Return what its EEPROM holds."""
        ...

    def flashCalibration(self, arg0: dai.CalibrationHandler, /) -> None:  # noqa: N802
        """Overwrite what its EEPROM holds."""
        ...


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


def flash_calibration(
    device: EepromDevice, content: dict[str, object], backup: Path, *, may_flash: bool
) -> None:
    """Write a calibration into the EEPROM of a device, and prove that it is there.

    What the EEPROM held before is saved first; without that nothing is written.

    Args:
        device: open.
        content: an EEPROM image as `rig export --format depthai` writes it.
        backup: file that does not exist yet; `flash_calibration` takes it back.
        may_flash: whoever calls has been asked for it explicitly.

    Raises:
        ConfigError: not permitted, no calibration, or the backup cannot be written.
        DeviceLostError: the device refused, or reads back something else.
    """
    name = f"OAK {device.getDeviceId()}"
    if not may_flash:
        raise ConfigError(
            f"{name}: asked to write its calibration, which overwrites the factory's; "
            "say so with --flash"
        )
    wanted = parse_calibration(content)
    _save(device, backup, name)
    try:
        device.flashCalibration(wanted)
        found = device.readCalibration2()
    except RuntimeError as error:
        raise DeviceLostError(
            name, f"did not take the calibration ({error}); what it held before is in {backup}"
        ) from error
    difference = first_difference(eeprom_content(wanted), eeprom_content(found))
    if difference is not None:
        raise DeviceLostError(
            name,
            f"wrote a calibration, reads back another one at {difference}; "
            f"write {backup} back, which holds what was there before",
        )


def parse_calibration(content: dict[str, object]) -> dai.CalibrationHandler:
    """Return an EEPROM image as the library's object.

    Raises:
        ConfigError: it holds no calibration; the library itself would take anything.
    """
    try:
        handler = dai.CalibrationHandler.fromJson(content)
        sockets = handler.getEepromData().cameraData
    except (RuntimeError, TypeError, ValueError) as error:
        raise ConfigError(f"this is no calibration of an OAK device: {error}") from error
    if not sockets:
        raise ConfigError(
            "this calibration describes no sensor (cameraData is empty); export it again"
        )
    for socket in sockets:
        if not handler.hasCameraCalibration(socket):
            raise ConfigError(f"this calibration lacks the intrinsics of {socket.name}")
    return handler


def eeprom_content(handler: dai.CalibrationHandler) -> dict[str, object]:
    """Return an EEPROM image as plain data, sensors in the order of their sockets."""
    content: dict[str, object] = dict(handler.eepromToJson())
    sensors = cast("list[list[object]]", content["cameraData"])
    content["cameraData"] = sorted(sensors, key=lambda entry: cast("int", entry[0]))
    return content


def first_difference(one: object, other: object, path: str = "") -> str | None:
    """Return where two EEPROM images differ by more than rounding, None where they do not."""
    if isinstance(one, dict) and isinstance(other, dict):
        left, right = cast("dict[str, object]", one), cast("dict[str, object]", other)
        for key in sorted(set(left) | set(right)):
            inner = first_difference(left.get(key), right.get(key), f"{path}.{key}".lstrip("."))
            if inner is not None:
                return inner
        return None
    if isinstance(one, list) and isinstance(other, list):
        items, others = cast("list[object]", one), cast("list[object]", other)
        if len(items) != len(others):
            return f"{path} ({len(items)} entries, {len(others)} found)"
        pairs = enumerate(zip(items, others, strict=True))
        found = (first_difference(a, b, f"{path}[{i}]") for i, (a, b) in pairs)
        return next((place for place in found if place is not None), None)
    if isinstance(one, float) and isinstance(other, int | float):
        same = math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING)
        return None if same else f"{path} ({one!r}, {other!r} found)"
    return None if one == other else f"{path} ({one!r}, {other!r} found)"


def _save(device: EepromDevice, backup: Path, name: str) -> None:
    try:
        before = eeprom_content(device.readCalibration2())
    except RuntimeError as error:
        raise ConfigError(
            f"{name}: its present calibration cannot be read ({error}), so there is nothing to go "
            "back to; nothing was written"
        ) from error
    try:
        with backup.open("x", encoding="utf-8") as file:
            json.dump(before, file, indent=2)
    except OSError as error:
        raise ConfigError(
            f"{name}: the backup {backup} cannot be written ({error.strerror}); nothing was flashed"
        ) from error


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
            f"the device holds no calibration of {name}: {error}; calibrate with rig calibrate"
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
