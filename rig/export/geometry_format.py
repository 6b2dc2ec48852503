"""What is common to the formats that hold a rig's geometry: written, read back, compared."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, cast

from rig.errors import ConfigError, FormatError, StoreError
from rig.export.agreement import aligned, largest_gap_px
from rig.export.exported import ExportedGeometry
from rig.export.formats import format_named, formats_of
from rig.export.lens_change import Narrow, Refit, exact_lens, refit
from rig.export.verdict import weakness, write_weakness
from rig.geometry.camera_model import CameraModel
from rig.geometry.rig_geometry import RigGeometry
from rig.stored import stored_rig

if TYPE_CHECKING:
    from rig.database import Store

AGREEMENT_PX = 1e-6
"""A file that is read back puts points no further than this from where the calibration does."""


@dataclass(frozen=True, slots=True)
class GeometryFormat:
    """One format of another tool."""

    name: str
    tool: str
    """Who reads it."""
    path: str
    """File that is made in the output folder; empty where it is the whole folder."""
    holds: tuple[Narrow, ...]
    """Lens models that it can hold."""
    write: Callable[[RigGeometry, Path], None] | None
    """Takes the geometry and the file or folder to write; None for one that is only read."""
    read: Callable[[Path], RigGeometry]
    unit_mm: float | None = 1000.0
    """Of its lengths, or as they are taken; None where every file tells."""
    comments: tuple[str, ...] = ()
    """Files that take a comment, `{view}` for each view; none where a format has no comments."""


@dataclass(frozen=True, slots=True)
class GeometryExport:
    """Writes a calibration in the `format` of the class, an `Exporter`."""

    format: ClassVar[GeometryFormat]

    refit: bool = False
    """Whether a lens that the format cannot hold is replaced by the nearest that it can."""

    def folder(self, number: int, out: Path | None) -> Path:
        """Return the folder to write into."""
        return out or Path(f"calibration_{number}_{self.format.name}")

    def export(self, store: "Store", number: int, out: Path | None) -> ExportedGeometry:
        """See `Exporter.export`."""
        stored = stored_rig(store, number)
        return export_geometry(
            stored.geometry,
            self.format,
            self.folder(number, out),
            may_refit=self.refit,
            weak=weakness(stored.quality),
        )


def geometry_format(name: str) -> GeometryFormat:
    """Return how a format of geometries is written and read.

    Raises:
        ConfigError: there is no such format, or it holds something else.
    """
    entry = format_named(name)
    if entry.kind != "geometry":
        raise ConfigError(
            f"format {name} asked for a calibration",
            advice=f"those that hold one are {', '.join(formats_of('geometry'))}",
        )
    return cast("GeometryFormat", entry.load_reader())


def export_geometry(
    geometry: RigGeometry,
    target: GeometryFormat,
    folder: Path,
    *,
    may_refit: bool = False,
    write: Callable[[RigGeometry, Path], None] | None = None,
    read_names: Mapping[str, str] | None = None,
    weak: str | None = None,
) -> ExportedGeometry:
    """Write a geometry, read it back, and compare where both put points.

    Args:
        geometry: what to write.
        target: the format.
        folder: an existing or new folder to write into.
        may_refit: whether a lens that the format cannot hold may be replaced by the nearest.
        write: the format's writer with its options set, where it has some.
        read_names: by view: what the format calls it, where that differs.
        weak: verdict of a weak calibration, written as a comment where the format takes one.

    Raises:
        FormatError: the format cannot hold a lens, or what was read back is not what was written.
        StoreError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(
            f"{folder}: cannot be made: {error.strerror}", advice="choose another"
        ) from error
    refits = _refits(geometry, target) if may_refit else {}
    cameras = zip(geometry.names, geometry.cameras, strict=True)
    written = replace(
        geometry,
        cameras=tuple(refits[n].camera if n in refits else c for n, c in cameras),
        covariance=None if refits else geometry.covariance,
    )
    path = folder / target.path if target.path else folder
    writer = write or target.write
    if writer is None:
        raise ConfigError(
            f"format {target.name} asked to be written, it is only read",
            advice="write another; other tools convert",
        )
    writer(written, path)
    if weak is not None:
        write_weakness(_commented(target, written, folder), weak)
    names = [(read_names or {}).get(name, name) for name in written.names]
    back = aligned(target.read(path), names, names[written.reference])
    gap_px = largest_gap_px(written, back)
    if not gap_px < AGREEMENT_PX:
        raise FormatError(
            f"{path}: read back, points lie {gap_px:.2g} px from where they should (allowed "
            f"{AGREEMENT_PX:g} px); do not use this file, and report it"
        )
    return ExportedGeometry(path, gap_px, refits, weak=weak, tells_weak=bool(target.comments))


def _commented(target: GeometryFormat, geometry: RigGeometry, folder: Path) -> Iterator[Path]:
    """The files of an export that take a comment."""
    named = (name.format(view=view) for name in target.comments for view in geometry.names)
    return (folder / name for name in dict.fromkeys(named) if (folder / name).exists())


def _refits(geometry: RigGeometry, target: GeometryFormat) -> dict[str, Refit]:
    cameras = zip(geometry.names, geometry.cameras, strict=True)
    return {
        name: min((refit(camera, held) for held in target.holds), key=lambda r: r.rms_px)
        for name, camera in cameras
        if not any(_is_held(camera, held, name) for held in target.holds)
    }


def _is_held(camera: CameraModel, held: Narrow, view: str) -> bool:
    try:
        exact_lens(camera, held, view=view, tool="")
    except FormatError:
        return False
    return True
