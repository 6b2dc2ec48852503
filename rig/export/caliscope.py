"""caliscope `camera_array.toml`, and the `config.toml` of older versions and of pyxy3d; read only.

Lengths in m. One table per camera, `cameras.N` or `cam_N`, with OpenCV's matrix and distortions.
Rotations are Rodrigues vectors, in older versions matrices. `rotation_count` turns pictures for
people to look at; cameras are those of the pictures as they were taken. Format: caliscope,
`CameraArray.to_toml`; pyxy3d, `Configurator`.
"""

import re
from pathlib import Path

from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryFormat
from rig.export.seen_from_one import seen_from_one
from rig.export.toml_cameras import camera_of, pose_of, read_toml
from rig.geometry.rig_geometry import RigGeometry

FILE = "camera_array.toml"
_MM_PER_M = 1000.0
_TABLE = re.compile(r"cam_(\d+)")


def read(path: Path) -> RigGeometry:
    """Read a camera array, or the folder it is in; views are called cam_N. Ignored cameras are not.

    Raises:
        FormatError: a field is missing or odd, or a camera has not been calibrated or placed.
        StoreError: the file cannot be read.
    """
    tables = {
        name: table
        for name, table in _tables(path).items()
        if table.get("ignore", False) is not True
    }
    if not tables:
        raise FormatError(
            f"{path}: holds no camera", advice="expected tables cameras.0, cameras.1, ..."
        )
    for name, table in tables.items():
        _require_solved(table, f"{path}: {name}")
    return seen_from_one(
        list(tables),
        [camera_of(table, f"{path}: {name}") for name, table in tables.items()],
        [pose_of(table, _MM_PER_M, f"{path}: {name}") for name, table in tables.items()],
    )


def _tables(path: Path) -> dict[str, fields.Fields]:
    content = read_toml(path, FILE)
    if "cameras" in content:
        listed = fields.mapping(content["cameras"], f"{path}: cameras")
        found = {f"cam_{key}": table for key, table in listed.items()}
    else:
        found = {key: table for key, table in content.items() if _TABLE.fullmatch(key)}
    return {name: fields.mapping(table, f"{path}: {name}") for name, table in found.items()}


def _require_solved(table: fields.Fields, where: str) -> None:
    """Refuse cameras that wait for a step of caliscope.

    Raises:
        FormatError: naming the step.
    """
    for key, step in (("matrix", "intrinsic calibration"), ("rotation", "extrinsic calibration")):
        if table.get(key) in (None, "null"):
            raise FormatError(
                f"{where}: has no {key}: it has not passed the {step} of caliscope",
                advice="do that there, or leave the camera out with ignore = true",
            )


FORMAT = GeometryFormat(
    "caliscope", "caliscope camera array", FILE, (), None, read, comments=(FILE,)
)
