"""The formats that hold a rig's geometry, and what each of them can hold."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rig.errors import ConfigError, FormatError, StoreError
from rig.export import colmap, depthai, kalibr, mrcal, opencv, ros
from rig.export.agreement import aligned, largest_gap_px
from rig.export.lens_change import Narrow, Refit, exact_lens, refit
from rig.geometry.camera_model import CameraModel
from rig.geometry.rig_geometry import RigGeometry

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
    write: Callable[[RigGeometry, Path], None]
    """Takes the geometry and the file or folder to write."""
    read: Callable[[Path], RigGeometry]


FORMATS: Mapping[str, GeometryFormat] = {
    entry.name: entry
    for entry in (
        GeometryFormat(
            "ros", "ROS camera_info", "", ("none", "brown5", "brown8", "fisheye"),
            ros.write, ros.read,
        ),
        GeometryFormat(
            "kalibr", "Kalibr camchain", "camchain.yaml", ("none", "brown4", "fisheye"),
            kalibr.write, kalibr.read,
        ),
        GeometryFormat(
            "opencv", "OpenCV FileStorage", "", ("none", "brown5", "brown8", "fisheye"),
            opencv.write, opencv.read,
        ),
        GeometryFormat(
            "depthai", "DepthAI EEPROM JSON", "calibration.json",
            ("none", "brown5", "brown8", "fisheye"), depthai.write, depthai.read,
        ),
        GeometryFormat(
            "mrcal", "mrcal camera models", "", ("none", "brown5", "brown8"),
            mrcal.write, mrcal.read,
        ),
        GeometryFormat(
            "colmap", "COLMAP text model", "", ("none", "brown5", "brown8", "fisheye"),
            colmap.write, colmap.read,
        ),
    )
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Exported:
    """What was written, and what had to be changed for it."""

    path: Path
    refits: Mapping[str, Refit]
    """By view: lenses that were replaced by the nearest that the format can hold."""
    gap_px: float
    """Largest distance of a point between the file, read back, and what was written."""


def format_named(name: str) -> GeometryFormat:
    """Return a format.

    Raises:
        ConfigError: there is none of this name.
    """
    if name not in FORMATS:
        raise ConfigError(f"format {name} asked for", advice=f"known are {', '.join(FORMATS)}")
    return FORMATS[name]


def export_geometry(
    geometry: RigGeometry,
    target: GeometryFormat,
    folder: Path,
    *,
    may_refit: bool = False,
    write: Callable[[RigGeometry, Path], None] | None = None,
    read_names: Mapping[str, str] | None = None,
) -> Exported:
    """Write a geometry, read it back, and compare where both put points.

    Args:
        geometry: what to write.
        target: the format.
        folder: an existing or new folder to write into.
        may_refit: whether a lens that the format cannot hold may be replaced by the nearest.
        write: the format's writer with its options set, where it has some.
        read_names: by view: what the format calls it, where that differs.

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
    (write or target.write)(written, path)
    names = [(read_names or {}).get(name, name) for name in written.names]
    back = aligned(target.read(path), names, names[written.reference])
    gap_px = largest_gap_px(written, back)
    if not gap_px < AGREEMENT_PX:
        raise FormatError(
            f"{path}: read back, points lie {gap_px:.2g} px from where they should (allowed "
            f"{AGREEMENT_PX:g} px)",
            advice="do not use this file, and report it",
        )
    return Exported(path, refits, gap_px)


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
