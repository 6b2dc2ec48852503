"""`--format depthai`: the file of a device, and on demand the device itself."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rig.errors import ConfigError
from rig.export import depthai
from rig.export.exported import ExportedGeometry
from rig.export.geometry_format import (
    GeometryExport,
    GeometryFormat,
    export_geometry,
)
from rig.export.verdict import weakness
from rig.geometry.rig_geometry import RigGeometry
from rig.hardware.opening import oak_eeprom
from rig.stored import stored_rig

if TYPE_CHECKING:
    from rig.database import Store


@dataclass(frozen=True, slots=True)
class DepthaiExport(GeometryExport):
    """Writes the EEPROM JSON of one device."""

    format: ClassVar = GeometryFormat(
        "depthai",
        "DepthAI EEPROM JSON",
        "calibration.json",
        ("none", "brown5", "brown8", "fisheye"),
        depthai.write,
        depthai.read,
        unit_mm=None,
    )

    socket: Mapping[str, str] = field(default_factory=dict[str, str])
    """By view: its socket, where the view is not called so."""
    device_json: Path | None = None
    """The device's own calibration, whose other contents are kept."""
    flash: bool = False
    """Whether the device gets the calibration, in place of the factory's."""
    backup: Path | None = None
    """New file for what the device held before."""
    device: str = ""
    """Id or address of the device to flash; empty takes the only one."""

    def __post_init__(self) -> None:
        if self.flash != (self.backup is not None):
            raise ConfigError("--flash and --backup belong together", advice="give both or none")
        if self.device and not self.flash:
            raise ConfigError("--device names the device to --flash", advice="give --flash as well")
        if self.flash and self.device_json is not None:
            raise ConfigError(
                "--flash starts from what the device holds", advice="omit --device-json"
            )

    def export(self, store: "Store", number: int, out: Path | None) -> ExportedGeometry:
        """See `Exporter.export`; with `flash` the device is read, written, and read back.

        Raises:
            ConfigError: the extra `oak` is not installed.
            DeviceError: the device is not there, or does not hold what was written.
            FormatError: a view has no socket, or the format cannot hold a lens.
            StoreError: no such calibration, or a file cannot be written.
        """
        stored = stored_rig(store, number)
        geometry, weak = stored.geometry, weakness(stored.quality)
        folder = self.folder(number, out)
        if self.backup is None:
            return self._write(geometry, folder, self.device_json, weak)
        with oak_eeprom(self.device) as eeprom:
            eeprom.save(self.backup)
            exported = self._write(geometry, folder, self.backup, weak)
            content = json.loads(exported.path.read_text(encoding="utf-8"))
            eeprom.flash(content, self.backup, may_flash=True)
        return replace(exported, backup=self.backup)

    def _write(
        self, geometry: RigGeometry, folder: Path, device_json: Path | None, weak: str | None
    ) -> ExportedGeometry:
        return export_geometry(
            geometry,
            self.format,
            folder,
            may_refit=self.refit,
            write=partial(depthai.write, sockets=self.socket, device=device_json),
            read_names=self.socket,
            weak=weak,
        )
