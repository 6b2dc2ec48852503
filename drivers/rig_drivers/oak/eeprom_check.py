"""Whether plain data is an EEPROM image: asked before the library sees it.

The library fills in what is missing and takes matrices of any shape, and numbers that are none.
"""

import math
from collections.abc import Mapping
from typing import cast

from rig.errors import ConfigError

_SOCKETS = range(10)
_MOST_COEFFICIENTS = 14
_TRIPLE = ("x", "y", "z")


def require_image(content: object) -> None:
    """Refuse what does not describe sensors that can be used.

    Args:
        content: an EEPROM image as JSON gives it.

    Raises:
        ConfigError: names the first place that is wrong.
    """
    image = _mapping(content, "the calibration")
    sensors = image.get("cameraData")
    if not isinstance(sensors, list) or not sensors:
        raise _wrong("cameraData", "describes no sensor")
    seen: set[int] = set()
    towards: dict[int, int] = {}
    for index, entry in enumerate(cast("list[object]", sensors)):
        where = f"cameraData[{index}]"
        pair = cast("list[object]", entry) if isinstance(entry, list) else []
        if len(pair) != 2:
            raise _wrong(where, "is no pair of socket and sensor")
        socket = _whole(pair[0], f"{where}[0]", least=0)
        if socket not in _SOCKETS or socket in seen:
            raise _wrong(f"{where}[0]", f"names socket {socket}, which is none or came before")
        seen.add(socket)
        towards[socket] = _require_sensor(_mapping(pair[1], f"{where}[1]"), f"{where}[1]")
    _require_chains(towards)


def _require_sensor(sensor: Mapping[str, object], where: str) -> int:
    """Check one sensor; return the socket that its pose refers to, -1 for none."""
    matrix = _square(sensor.get("intrinsicMatrix"), f"{where}.intrinsicMatrix")
    if not (matrix[0] > 0.0 and matrix[4] > 0.0):
        raise _wrong(f"{where}.intrinsicMatrix", "has a focal length that is not positive")
    for key in ("width", "height"):
        _whole(sensor.get(key), f"{where}.{key}", least=1)
    coefficients = _numbers(sensor.get("distortionCoeff"), f"{where}.distortionCoeff")
    if len(coefficients) > _MOST_COEFFICIENTS:
        raise _wrong(f"{where}.distortionCoeff", f"has {len(coefficients)} numbers, 14 are known")
    place = f"{where}.extrinsics"
    pose = _mapping(sensor.get("extrinsics"), place)
    for key in ("translation", "specTranslation"):
        triple = _mapping(pose.get(key), f"{place}.{key}")
        for axis in _TRIPLE:
            _number(triple.get(axis), f"{place}.{key}.{axis}")
    target = _whole(pose.get("toCameraSocket"), f"{place}.toCameraSocket", least=-1)
    if target >= 0:
        _square(pose.get("rotationMatrix"), f"{place}.rotationMatrix")
    return target


def _require_chains(towards: Mapping[int, int]) -> None:
    """Refuse poses that refer to sensors that are not there, or in a circle."""
    for start in towards:
        socket, steps = start, 0
        while towards[socket] >= 0:
            socket, steps = towards[socket], steps + 1
            if socket not in towards:
                raise _wrong(
                    "cameraData", f"has a pose towards socket {socket}, which is not there"
                )
            if steps > len(towards):
                raise _wrong("cameraData", "has poses that refer to each other in a circle")


def _mapping(value: object, where: str) -> Mapping[str, object]:
    if not isinstance(value, dict):
        raise _wrong(where, "is no object")
    return cast("dict[str, object]", value)


def _square(value: object, where: str) -> list[float]:
    """Return the nine numbers of a 3 x 3 matrix."""
    rows = cast("list[object]", value) if isinstance(value, list) else []
    numbers = [number for row in rows for number in _numbers(row, where)]
    if len(rows) != 3 or any(len(cast("list[object]", row)) != 3 for row in rows):
        raise _wrong(where, "is no 3 x 3 matrix")
    return numbers


def _numbers(value: object, where: str) -> list[float]:
    if not isinstance(value, list):
        raise _wrong(where, "is no list of numbers")
    return [_number(item, where) for item in cast("list[object]", value)]


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(where, "is no number")
    number = float(value) if abs(value) < 1e30 else math.inf
    if not math.isfinite(number):
        raise _wrong(where, "is no number that an EEPROM can hold")
    return number


def _whole(value: object, where: str, *, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value < 2**31:
        raise _wrong(where, f"is no whole number from {least} on")
    return value


def _wrong(where: str, why: str) -> ConfigError:
    return ConfigError(
        f"this is no calibration of an OAK device: {where} {why}", advice="export it again"
    )
