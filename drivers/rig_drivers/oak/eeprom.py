"""The EEPROM image of a device: read, saved, and written only on purpose, with a way back."""

import hashlib
import json
import math
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, cast

from rig.errors import ConfigError, DeviceLostError
from rig_drivers.oak.discovery import open_oak
from rig_drivers.oak.eeprom_check import require_image
from rig_drivers.oak.sdk import dai

_ROUNDING = 1e-5
"""The EEPROM holds single-precision numbers."""


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


@dataclass(frozen=True, slots=True)
class Eeprom:
    """The EEPROM of an open device."""

    device: EepromDevice

    @property
    def name(self) -> str:
        """Name of the device in messages."""
        return f"OAK {self.device.getDeviceId()}"

    def save(self, backup: Path) -> None:
        """Write what the EEPROM holds into a new file.

        Raises:
            ConfigError: it cannot be read, or the file exists or cannot be written.
        """
        content = json.dumps(self._content(), indent=2)
        try:
            with backup.open("x", encoding="utf-8") as file:
                file.write(content)
        except OSError as error:
            raise ConfigError(
                f"{self.name}: the backup {backup} cannot be written ({error.strerror})",
                advice="name a file that does not exist; nothing was flashed",
            ) from error

    def flash(self, content: Mapping[str, object], backup: Path, *, may_flash: bool) -> None:
        """Write a calibration into the EEPROM, and prove that it is there.

        Args:
            content: an image as `rig export --format depthai` writes it.
            backup: file of `save`; it must hold what the EEPROM holds now, and can be flashed.
            may_flash: whoever calls has been asked for it explicitly.

        Raises:
            ConfigError: not permitted, no calibration, or no backup of what is there now.
            DeviceLostError: the device refused, or reads back something else.
        """
        if not may_flash:
            raise ConfigError(
                f"{self.name}: asked to write its calibration, which overwrites the factory's",
                advice="say so with --flash",
            )
        wanted = parse_calibration(content)
        self._require_backup(backup)
        try:
            self.device.flashCalibration(wanted)
            found = self.device.readCalibration2()
        except RuntimeError as error:
            raise DeviceLostError(
                self.name,
                f"did not take the calibration ({error})",
                advice=f"what it held before is in {backup}",
            ) from error
        difference = first_difference(eeprom_content(wanted), eeprom_content(found))
        if difference is not None:
            raise DeviceLostError(
                self.name,
                f"wrote a calibration, reads back another one at {difference}",
                advice=f"write {backup} back, which holds what was there before",
            )

    def _content(self) -> dict[str, object]:
        try:
            return eeprom_content(self.device.readCalibration2())
        except RuntimeError as error:
            raise ConfigError(
                f"{self.name}: its present calibration cannot be read ({error}), so there is "
                "nothing to go back to",
                advice="open it again; nothing was flashed",
            ) from error

    def _require_backup(self, backup: Path) -> None:
        try:
            saved: object = json.loads(backup.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ConfigError(
                f"{self.name}: the backup {backup} cannot be read ({error})",
                advice="save a new one; nothing was flashed",
            ) from error
        difference = first_difference(saved, self._content())
        if difference is not None:
            raise ConfigError(
                f"{self.name}: {backup} is no backup of what the device holds, which differs at "
                f"{difference}",
                advice="save a new one; nothing was flashed",
            )


@contextmanager
def open_eeprom(device: str) -> Generator[Eeprom]:
    """Open a device for its EEPROM only; no sensor is started.

    Args:
        device: id or address; empty for the only one.

    Raises:
        DeviceNotFoundError: it is not there or cannot be opened.
    """
    opened = open_oak(device)
    try:
        yield Eeprom(opened)
    finally:
        opened.close()


def parse_calibration(content: Mapping[str, object]) -> dai.CalibrationHandler:
    """Return an EEPROM image as the library's object.

    Raises:
        ConfigError: it holds no calibration; names the first place that is wrong.
    """
    require_image(content)
    try:
        return dai.CalibrationHandler.fromJson(dict(content))
    except (RuntimeError, TypeError, ValueError) as error:
        raise ConfigError(
            f"this is no calibration of an OAK device: {error}", advice="export it again"
        ) from error


def eeprom_content(handler: dai.CalibrationHandler) -> dict[str, object]:
    """Return an EEPROM image as plain data, sensors in the order of their sockets."""
    content: dict[str, object] = dict(handler.eepromToJson())
    sensors = cast("list[list[object]]", content["cameraData"])
    content["cameraData"] = sorted(sensors, key=lambda entry: cast("int", entry[0]))
    return content


def calibration_sha256(handler: dai.CalibrationHandler) -> str:
    """Return what tells one calibration of the sensors from another: the hash of all of it.

    Names and numbers of the board do not count.
    """
    return hashlib.sha256(json.dumps(eeprom_content(handler)["cameraData"]).encode()).hexdigest()


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
