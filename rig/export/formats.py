"""The one table of other programs' formats; what writes them is imported when it is asked for."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, TypeVar, cast

from rig.errors import ConfigError

if TYPE_CHECKING:
    from rig.database import Store
    from rig.export.exported import Exported, ExportedCapture


_E = TypeVar("_E", "Exporter", "CaptureExporter")


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


class CaptureExporter(Protocol):
    """Writes what `rig capture` wrote in one format; fields are options, as in `Exporter`."""

    __dataclass_fields__: ClassVar[dict[str, Field[object]]]

    def export(self, source: Path, out: Path | None) -> "ExportedCapture":
        """Write the frames of a capture.

        Args:
            source: folder or recording, what `rig.read_capture` takes.
            out: file or folder to write; None makes a name of source and format, here.

        Raises:
            CalibrationError: points are wanted, and nothing tells the focal length.
            FormatError: the capture is damaged, or the format cannot hold it.
            StoreError: it is not there, has no such frames, or cannot be written.
        """
        ...


Kind = Literal["geometry", "samples", "depth", "capture"]
"""What a format holds: a calibration, which is read as well; the samples of a sweep; a depth map of
a capture by a stored calibration; captures, and nothing that has a number."""


@dataclass(frozen=True, slots=True)
class Format:
    """One format."""

    name: str
    kind: Kind
    exporter: str = ""
    """`module:class` below `rig.export`: writes what has a number; empty where nothing has."""
    capture: str = ""
    """`module:class` below `rig.export`: writes captures; empty where the format holds none."""
    reader: str = ""
    """`module:name` below `rig.export`: how a geometry is read, where nothing here writes it."""

    def load(self) -> type[Exporter]:
        """Import what writes a number of the store.

        Raises:
            ConfigError: the format holds captures only, or is only read.
        """
        if self.reader:
            raise ConfigError(
                f"--format {self.name} is only read here, asked to write it",
                advice=f"those that are written are {', '.join(written_formats())}",
            )
        if not self.exporter:
            raise ConfigError(
                f"--format {self.name} holds captures, asked to write what has a number",
                advice="give the folder of `rig capture --out` instead of a number",
            )
        return cast("type[Exporter]", _loaded(self.exporter))

    def load_reader(self) -> object:
        """Import the `GeometryFormat` of a calibration's format."""
        return _loaded(self.reader) if self.reader else vars(self.load())["format"]

    def load_capture(self) -> type[CaptureExporter]:
        """Import what writes captures.

        Raises:
            ConfigError: the format does not hold them.
        """
        if not self.capture:
            raise ConfigError(
                f"--format {self.name} holds no captures",
                advice=f"those that do are {', '.join(capture_formats())}; else give the number of "
                "a calibration or sweep",
            )
        return cast("type[CaptureExporter]", _loaded(self.capture))


FORMATS: Mapping[str, Format] = {
    entry.name: entry
    for entry in (
        Format("ros", "geometry", "ros:RosExport"),
        Format("kalibr", "geometry", "kalibr:KalibrExport"),
        Format("opencv", "geometry", "opencv:OpencvExport"),
        Format("depthai", "geometry", "depthai_export:DepthaiExport"),
        Format("mrcal", "geometry", "mrcal:MrcalExport"),
        Format("colmap", "geometry", "colmap:ColmapExport"),
        Format("anipose", "geometry", "anipose:AniposeExport"),
        Format("caliscope", "geometry", reader="caliscope:FORMAT"),
        Format("zed", "geometry", reader="zed:FORMAT"),
        Format("csv", "samples", "samples:CsvExport"),
        Format("parquet", "samples", "parquet:ParquetExport"),
        Format("ply", "depth", "ply:PlyExport", capture="ply:CapturePly"),
        Format("npz", "capture", capture="npz:NpzExport"),
        Format("tiff", "capture", capture="tiff:TiffExport"),
        Format("pcd", "capture", capture="pcd:PcdExport"),
        Format("rosbag2", "capture", capture="rosbag2:Rosbag2Export"),
    )
}


def formats_of(kind: Kind) -> tuple[str, ...]:
    """Return the names of the formats of a kind."""
    return tuple(entry.name for entry in FORMATS.values() if entry.kind == kind)


def written_formats() -> tuple[str, ...]:
    """Return the names of the formats that are written; the others are only read."""
    return tuple(entry.name for entry in FORMATS.values() if entry.exporter or entry.capture)


def capture_formats() -> tuple[str, ...]:
    """Return the names of the formats that hold captures."""
    return tuple(entry.name for entry in FORMATS.values() if entry.capture)


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
    return _with_options(format_named(name).load(), name, given)


def capture_exporter_for(name: str, given: Mapping[str, object]) -> CaptureExporter:
    """Return what writes captures in a format, with its options set; see `exporter_for`.

    Raises:
        ConfigError: see `exporter_for`; or the format holds no captures.
    """
    return _with_options(format_named(name).load_capture(), name, given)


def _with_options(exporter: type[_E], name: str, given: Mapping[str, object]) -> _E:
    foreign = [option for option in given if option not in _options(exporter)]
    if foreign:
        raise ConfigError(
            f"--format {name} does not know {_listed(foreign)}", advice="; ".join(_homes(foreign))
        )
    missing = [option for option in _required(exporter) if option not in given]
    if missing:
        raise ConfigError(f"--format {name}: needs {_listed(missing)}", advice="give it as well")
    return cast("Callable[..., _E]", exporter)(**given)


def _loaded(place: str) -> object:
    module, _, name = place.partition(":")
    return getattr(import_module(f"rig.export.{module}"), name)


def _options(exporter: type[Exporter] | type[CaptureExporter]) -> tuple[str, ...]:
    return tuple(field.name for field in fields(exporter))


def _required(exporter: type[Exporter] | type[CaptureExporter]) -> tuple[str, ...]:
    return tuple(
        field.name
        for field in fields(exporter)
        if field.default is MISSING and field.default_factory is MISSING
    )


def _homes(options: list[str]) -> list[str]:
    """Say which formats know some options."""
    known = {entry.name: _known(entry) for entry in FORMATS.values()}
    by_formats: dict[str, list[str]] = {}
    for option in options:
        at_home = ", ".join(name for name, names in known.items() if option in names)
        by_formats.setdefault(at_home, []).append(option)
    return [
        f"{_listed(names)} {'go' if len(names) > 1 else 'goes'} with {at_home}"
        for at_home, names in by_formats.items()
    ]


def _known(entry: Format) -> tuple[str, ...]:
    """Every option of a format, whatever it is to write."""
    numbers = _options(entry.load()) if entry.exporter else ()
    return numbers + (_options(entry.load_capture()) if entry.capture else ())


def _listed(options: list[str]) -> str:
    return " and ".join(f"--{option.replace('_', '-')}" for option in options)
