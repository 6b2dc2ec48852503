"""Takes numbers out of what a file held, and says which are missing or odd."""

import json
import math
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

import numpy as np
import yaml

from rig.arrays import Float
from rig.bounded_text import read_text
from rig.errors import ConfigError, FormatError
from rig.export.bounded_yaml import BoundedLoader
from rig.export.quaternion import matrix_of
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose

Fields = Mapping[str, object]

MOST_JSON_BYTES = 1_000_000
_LARGEST = 1e300
"""Whole numbers know no bound; beyond this they are no numbers of a camera."""
_MOST_SKEW_PX = 1e-6
"""A camera here has none; what is less is rounding."""
_MOST_TURN_RAD = 1e3
"""Of a Rodrigues vector; half a turn is the most that one needs."""
_FARTHEST_MM = 1e9
_MOST_TILT = 1e-5
"""Files hold rounded rotations; further off than this they are none."""


def read_yaml(path: Path, loader: type[BoundedLoader] = BoundedLoader) -> Fields:
    """Return the top-level mapping of a YAML file.

    Args:
        path: file to read.
        loader: with the tags of the format.

    Raises:
        StoreError: it cannot be read.
        FormatError: it is no YAML mapping.
    """
    try:
        # Loaders of this type build plain values only. OpenCV's `%YAML:1.0` is no directive.
        content = yaml.load(read_text(path).removeprefix("%YAML:1.0"), loader)  # noqa: S506
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        line = " ".join(str(error).split())
        raise FormatError(f"{path}: is no YAML: {line}") from error
    return mapping(content, str(path))


def read_json(path: Path, most: int = MOST_JSON_BYTES) -> Fields:
    """Return the top-level mapping of a JSON file.

    Args:
        path: file to read.
        most: bytes that any such file has.

    Raises:
        StoreError: it cannot be read.
        FormatError: it is no JSON mapping.
    """
    try:
        content = json.loads(read_text(path, most).lstrip("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is no JSON: {error}") from error
    return mapping(content, str(path))


def mapping(value: object, where: str) -> Fields:
    """Return a mapping with text keys, or raise FormatError."""
    if not isinstance(value, Mapping):
        raise FormatError(f"{where}: expected named fields, found {_kind(value)}")
    return {str(key): item for key, item in cast("Mapping[object, object]", value).items()}


def field(fields: Fields, name: str, where: str) -> object:
    """Return one field, or raise FormatError naming it."""
    if name not in fields:
        present = ", ".join(str(key)[:40] for key in list(fields)[:8]) or "none"
        raise FormatError(f"{where}: has no {name}", advice=f"its fields are {present}")
    return fields[name]


def text(fields: Fields, name: str, where: str) -> str:
    """Return a text field."""
    value = field(fields, name, where)
    if not isinstance(value, str):
        raise FormatError(f"{where}: {name} must be text, found {_kind(value)}")
    return value


def numbers(value: object, where: str, *, count: int | None = None) -> list[float]:
    """Return a list of finite numbers, of `count` where given."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise FormatError(f"{where}: expected a list of numbers, found {_kind(value)}")
    found: list[float] = []
    for item in cast("Sequence[object]", value):
        if isinstance(item, bool) or not isinstance(item, int | float) or not abs(item) < _LARGEST:
            raise FormatError(f"{where}: expected finite numbers, found {_kind(item)}")
        found.append(float(item))
    if count is not None and len(found) != count:
        raise FormatError(f"{where}: expected {count} numbers, found {len(found)}")
    return found


def four(value: object, where: str) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy."""
    fx_px, fy_px, cx_px, cy_px = numbers(value, where, count=4)
    return fx_px, fy_px, cx_px, cy_px


def of_matrix(matrix: Float) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy of a (3, 3) camera matrix."""
    return float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])


def require_no_skew(matrix: Float, where: str) -> None:
    """Refuse a (3, 3) camera matrix that a camera of four numbers cannot be.

    Raises:
        FormatError: it has a skew, or its last row is not 0, 0, 1.
    """
    rest = [matrix[0, 1], matrix[1, 0], *matrix[2, :2], matrix[2, 2] - 1.0]
    if not float(np.abs(rest).max()) < _MOST_SKEW_PX:
        raise FormatError(
            f"{where}: is {matrix.tolist()}, expected fx, 0, cx; 0, fy, cy; 0, 0, 1",
            advice="calibrate again with pixels that are not skewed",
        )


def number(value: object, where: str) -> float:
    """Return one finite number."""
    return numbers([value], where)[0]


def size_px(value: object, where: str) -> int:
    """Return a picture size."""
    found = number(value, where)
    if not (found.is_integer() and 0 < found < 1e6):
        raise FormatError(f"{where}: expected a picture size in px, found {found:g}")
    return int(found)


def matrix(value: object, shape: tuple[int, int], where: str) -> Float:
    """Return rows of numbers as an array."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise FormatError(f"{where}: expected {shape[0]} rows of numbers, found {_kind(value)}")
    rows = [numbers(row, where, count=shape[1]) for row in cast("Sequence[object]", value)]
    if len(rows) != shape[0]:
        raise FormatError(f"{where}: expected {shape[0]} rows, found {len(rows)}")
    return np.array(rows, np.float64)


def pose(rotation: Float, translation_mm: Sequence[float], where: str) -> Pose:
    """Return a pose; a rotation that a file has rounded is made exact again.

    Raises:
        FormatError: it is no rotation, or goes further than any camera stands.
    """
    try:
        u, _, vt = np.linalg.svd(rotation)
    except np.linalg.LinAlgError as error:
        raise FormatError(f"{where}: holds no rotation") from error
    nearest = u @ vt
    off = float(np.abs(nearest - rotation).max())
    if not off < _MOST_TILT or np.linalg.det(nearest) < 0:
        raise FormatError(f"{where}: is no rotation, it is {off:.2g} away from the nearest one")
    return Pose(nearest if off > 1e-15 else rotation, _within_reach(translation_mm, where))


def turned(vector_rad: Sequence[float], translation_mm: Sequence[float], where: str) -> Pose:
    """Return the pose of a Rodrigues vector.

    Raises:
        FormatError: it turns about thousands of times, or goes further than any camera stands.
    """
    turn_rad = math.hypot(*vector_rad)
    if not turn_rad < _MOST_TURN_RAD:
        raise FormatError(f"{where}: is no Rodrigues vector in rad, its length is {turn_rad:g}")
    moved_mm = _within_reach(translation_mm, where)
    return Pose.from_vectors(np.array(vector_rad), moved_mm)


def quaternion(xyzw: Sequence[float], translation_mm: Sequence[float], where: str) -> Pose:
    """Return the pose of a quaternion, whose length may be rounded.

    Raises:
        FormatError: it is none, or goes further than any camera stands.
    """
    length = math.hypot(*xyzw)  # infinite without a warning where numbers are absurd
    if not 0.99 < length < 1.01:
        raise FormatError(f"{where}: its quaternion has length {length:g}, expected 1")
    return Pose(matrix_of(xyzw), _within_reach(translation_mm, where))


def _within_reach(translation_mm: Sequence[float], where: str) -> Float:
    away_mm = math.hypot(*translation_mm)  # not a number where one of them is none
    if not away_mm < _FARTHEST_MM:
        raise FormatError(f"{where}: stands {away_mm / 1e3:.3g} m away, no camera of a rig does")
    return np.array(translation_mm, np.float64)


def camera(
    size: tuple[int, int],
    intrinsics: tuple[float, float, float, float],
    lens: LensModel,
    coefficients: Sequence[float],
    where: str,
) -> CameraModel:
    """Return a camera of (width, height) px and fx, fy, cx, cy, or raise FormatError."""
    try:
        fx_px, fy_px, cx_px, cy_px = intrinsics
        return CameraModel(*size, fx_px, fy_px, cx_px, cy_px, lens, tuple(coefficients))
    except ConfigError as error:
        raise FormatError(f"{where}: {error}") from error


def _kind(value: object) -> str:
    if value is None:
        return "nothing"
    shown = reprlib.repr(
        value
    )  # bounded: what a file says ten times of ten may be a thousand million
    return f"{type(value).__name__} {shown[:40]}"
