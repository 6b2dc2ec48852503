"""The one table of other programs' formats; what writes them is imported when it is asked for."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, cast

from rig.errors import ConfigError

if TYPE_CHECKING:
    from rig.database import Store
    from rig.export.exported import Exported


class Exporter(Protocol):
    """Writes one format; the fields of the dataclass are the options that it knows.

    A field `device_json` is the option `--device-json`; one without a default must be given.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[object]]]

    def export(self, store: "Store", number: int, out: Path | None) -> "Exported":
        """Write what a number of the store stands for.

        Args:
            store: where it is.
            number: of a calibration, or of a sweep: see `Format.kind`.
            out: file or folder to write; None makes a name of number and format, here.

        Raises:
            FormatError: the format cannot hold it.
            StoreError: it is not there, or cannot be written.
        """
        ...


@dataclass(frozen=True, slots=True)
class Format:
    """One format."""

    name: str
    kind: Literal["geometry", "samples", "depth"]
    """What it holds: a calibration, which is read as well; the samples of a sweep; a depth map."""
    exporter: str
    """`module:class` below `rig.export`."""

    def load(self) -> type[Exporter]:
        """Import what writes it."""
        module, _, name = self.exporter.partition(":")
        return cast("type[Exporter]", getattr(import_module(f"rig.export.{module}"), name))


FORMATS: Mapping[str, Format] = {
    entry.name: entry
    for entry in (
        Format("ros", "geometry", "ros:RosExport"),
        Format("kalibr", "geometry", "kalibr:KalibrExport"),
        Format("opencv", "geometry", "opencv:OpencvExport"),
        Format("depthai", "geometry", "depthai_export:DepthaiExport"),
        Format("mrcal", "geometry", "mrcal:MrcalExport"),
        Format("colmap", "geometry", "colmap:ColmapExport"),
        Format("csv", "samples", "samples:CsvExport"),
        Format("parquet", "samples", "parquet:ParquetExport"),
        Format("ply", "depth", "ply:PlyExport"),
    )
}


def formats_of(kind: Literal["geometry", "samples", "depth"]) -> tuple[str, ...]:
    """Return the names of the formats of a kind."""
    return tuple(entry.name for entry in FORMATS.values() if entry.kind == kind)


def format_named(name: str) -> Format:
    """Return a format.

    Raises:
        ConfigError: there is none of this name.
    """
    if name not in FORMATS:
        raise ConfigError(f"format {name} asked for", advice=f"known are {', '.join(FORMATS)}")
    return FORMATS[name]


def exporter_for(name: str, given: Mapping[str, object]) -> Exporter:
    """Return the exporter of a format with its options set.

    Args:
        name: of the format.
        given: options by the name of their field, those only that were given.

    Raises:
        ConfigError: no such format, an option that it does not know or cannot go without, or
            options that contradict each other.
    """
    exporter = format_named(name).load()
    foreign = [option for option in given if option not in _options(exporter)]
    if foreign:
        raise ConfigError(
            f"--format {name} does not know {_listed(foreign)}", advice="; ".join(_homes(foreign))
        )
    missing = [option for option in _required(exporter) if option not in given]
    if missing:
        raise ConfigError(f"--format {name}: needs {_listed(missing)}", advice="give it as well")
    return cast("Callable[..., Exporter]", exporter)(**given)


def _options(exporter: type[Exporter]) -> tuple[str, ...]:
    return tuple(field.name for field in fields(exporter))


def _required(exporter: type[Exporter]) -> tuple[str, ...]:
    return tuple(
        field.name
        for field in fields(exporter)
        if field.default is MISSING and field.default_factory is MISSING
    )


def _homes(options: list[str]) -> list[str]:
    """Say which formats know some options."""
    known = {entry.name: _options(entry.load()) for entry in FORMATS.values()}
    by_formats: dict[str, list[str]] = {}
    for option in options:
        at_home = ", ".join(name for name, names in known.items() if option in names)
        by_formats.setdefault(at_home, []).append(option)
    return [
        f"{_listed(names)} {'go' if len(names) > 1 else 'goes'} with {at_home}"
        for at_home, names in by_formats.items()
    ]


def _listed(options: list[str]) -> str:
    return " and ".join(f"--{option.replace('_', '-')}" for option in options)
