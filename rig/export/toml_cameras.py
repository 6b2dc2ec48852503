"""Cameras in the TOML files of anipose and caliscope, which name their fields alike.

`matrix` and `distortions` are OpenCV's, four of its fisheye where `fisheye` is true; `rotation` (a
Rodrigues vector, or a matrix) and `translation` take points of a common frame into the camera.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import cast

from rig.bounded_text import parse_toml, read_text
from rig.errors import FormatError
from rig.export import fields
from rig.export.opencv_lens import fisheye_lens, opencv_lens
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose


def read_toml(path: Path, name: str) -> fields.Fields:
    """Return the tables of a TOML file.

    Args:
        path: the file, or the folder that it is in.
        name: what the tool calls the file.

    Raises:
        StoreError: it cannot be read.
        FormatError: it is no TOML, or nested deeper or longer than any such file.
    """
    file = path / name if path.is_dir() else path
    try:
        return fields.mapping(parse_toml(read_text(file)), str(file))
    except ValueError as error:
        line = " ".join(str(error).split())
        raise FormatError(f"{file}: is no TOML: {line}") from error


def camera_of(table: fields.Fields, where: str) -> CameraModel:
    """Return the camera of a table.

    Raises:
        FormatError: a field is missing or odd.
    """
    matrix = fields.matrix(fields.field(table, "matrix", where), (3, 3), f"{where} matrix")
    fields.require_no_skew(matrix, f"{where} matrix")
    flat = fields.numbers(fields.field(table, "distortions", where), f"{where} distortions")
    lens, coefficients = (fisheye_lens if is_fisheye(table, where) else opencv_lens)(
        flat, f"{where} distortions"
    )
    sizes = fields.numbers(fields.field(table, "size", where), f"{where} size", count=2)
    width, height = (fields.size_px(size, f"{where} size") for size in sizes)
    return fields.camera((width, height), fields.of_matrix(matrix), lens, coefficients, where)


def is_fisheye(table: fields.Fields, where: str) -> bool:
    """Say whether a table is one of a fisheye; it need not say so.

    Raises:
        FormatError: it says neither true nor false.
    """
    said = table.get("fisheye", False)
    if not isinstance(said, bool):
        raise FormatError(f"{where}: fisheye must be true or false")
    return said


def pose_of(table: fields.Fields, unit_mm: float, where: str) -> Pose:
    """Return the pose of a table, from the common frame into the camera.

    Raises:
        FormatError: a field is missing or odd.
    """
    moved = fields.numbers(
        fields.field(table, "translation", where), f"{where} translation", count=3
    )
    moved_mm = [unit_mm * length for length in moved]
    turn = fields.field(table, "rotation", where)
    if isinstance(turn, Sequence) and len(cast("Sequence[object]", turn)) == 3:
        first = cast("Sequence[object]", turn)[0]
        if isinstance(first, Sequence):
            rotation = fields.matrix(turn, (3, 3), f"{where} rotation")
            return fields.pose(rotation, moved_mm, f"{where} rotation")
    vector = fields.numbers(turn, f"{where} rotation", count=3)
    return fields.turned(vector, moved_mm, f"{where} rotation")
