"""anipose `calibration.toml`: one table per camera, `metadata` about the solve.

Its lengths are those in which the squares of its board were given, by its manual mm. Rotations are
Rodrigues vectors, cameras OpenCV's. Format: aniposelib, `CameraGroup.dump`.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.export.seen_from_one import seen_from_one
from rig.export.toml_cameras import camera_of, pose_of, read_toml
from rig.files import write_bytes
from rig.geometry.rig_geometry import RigGeometry

FILE = "calibration.toml"
_NO_CAMERA = "metadata"
_PLAIN = 5
"""Coefficients of a camera without a lens: aniposelib wants its five zeros."""


def write(geometry: RigGeometry, path: Path) -> None:
    """Write all views, in their order, as seen from the reference.

    Raises:
        StoreError: the file cannot be written.
    """
    lines: list[str] = []
    for number, (name, camera, pose) in enumerate(
        zip(geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True)
    ):
        lines += [
            f"[cam_{number}]",
            f"name = {json.dumps(name)}",
            f"size = [{camera.width_px}, {camera.height_px}]",
            f"matrix = {camera.matrix.tolist()}",
            f"distortions = {[float(k) for k in camera.coefficients or (0.0,) * _PLAIN]}",
            f"rotation = {pose.rotation_rad.tolist()}",
            f"translation = {pose.translation_mm.tolist()}",
            *(["fisheye = true"] if camera.lens == "fisheye" else []),
            "",
        ]
    # aniposelib expects the table, also where there is nothing to say.
    write_bytes(path, "\n".join([*lines, f"[{_NO_CAMERA}]", ""]).encode())


def read(path: Path) -> RigGeometry:
    """Read a calibration, or the folder it is in; views are called as its cameras are.

    Raises:
        FormatError: a field is missing or odd, or two cameras have one name.
        StoreError: the file cannot be read.
    """
    content = read_toml(path, FILE)
    tables = {
        key: fields.mapping(table, f"{path}: {key}")
        for key, table in sorted(content.items())
        if key != _NO_CAMERA
    }
    if not tables:
        raise FormatError(f"{path}: holds no camera", advice="expected tables cam_0, cam_1, ...")
    names = [fields.text(table, "name", f"{path}: {key}") for key, table in tables.items()]
    if len(set(names)) != len(names):
        raise FormatError(f"{path}: two cameras have one name: {', '.join(names)}")
    return seen_from_one(
        names,
        [camera_of(table, f"{path}: {key}") for key, table in tables.items()],
        [pose_of(table, 1.0, f"{path}: {key}") for key, table in tables.items()],
    )


@dataclass(frozen=True, slots=True)
class AniposeExport(GeometryExport):
    """Writes a calibration for anipose."""

    format: ClassVar = GeometryFormat(
        "anipose",
        "anipose calibration",
        FILE,
        ("none", "brown5", "brown8", "fisheye"),
        write,
        read,
        unit_mm=1.0,
        comments=(FILE,),
    )
