"""OpenCV FileStorage YAML: all views in one file; a pair also as OpenCV's stereo sample has it.

Lengths in mm. `views` holds per view its name, picture size, camera matrix, distortion (OpenCV's
order) and model, and the rotation and translation that take points of the reference frame into the
camera. What others write is read by `rig.export.opencv_found`. One camera alone is also written as
`camera.yml`, as the calibration sample writes it.

OpenCV writes the files; reading is done here, because OpenCV's own parser can hang on damaged ones.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, cast

import cv2
import numpy as np
import yaml

from rig.arrays import Float
from rig.bounded_text import read_text
from rig.errors import FormatError
from rig.export import fields
from rig.export.bounded_yaml import BoundedLoader
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.export.opencv_found import (
    array,
    flat,
    holds_one,
    holds_pair,
    holds_place,
    one_of,
    pair_of,
)
from rig.export.opencv_xml import read_xml
from rig.files import write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import COEFFICIENTS, LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

FILE = "rig.yml"
_ONE = "camera.yml"
_SAMPLE = ("intrinsics.yml", "extrinsics.yml")


def write(geometry: RigGeometry, folder: Path) -> None:
    """Write `rig.yml`, for two views `intrinsics.yml` and `extrinsics.yml`, for one `camera.yml`.

    Raises:
        StoreError: a file cannot be written.
    """
    storage = cv2.FileStorage(FILE, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("reference", geometry.names[geometry.reference])
    storage.startWriteStruct("views", cv2.FileNode_SEQ)
    for name, camera, pose in zip(
        geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True
    ):
        storage.startWriteStruct("", cv2.FileNode_MAP)
        storage.write("name", name)
        storage.write("image_width", camera.width_px)
        storage.write("image_height", camera.height_px)
        storage.write("camera_matrix", camera.matrix)
        storage.write("distortion_model", camera.lens)
        storage.write("distortion_coefficients", _row(camera))
        storage.write("rotation", pose.rotation)
        storage.write("translation_mm", pose.translation_mm.reshape(3, 1))
        storage.endWriteStruct()
    storage.endWriteStruct()
    write_bytes(folder / FILE, storage.releaseAndGetString().encode())
    if len(geometry.names) == 1:
        _write_one(geometry.cameras[0], folder)
    if len(geometry.names) == 2 and all(c.lens != "fisheye" for c in geometry.cameras):
        _write_sample(geometry, folder)


def read(path: Path) -> RigGeometry:
    """Read what this writes, or what OpenCV's samples and other people write; YAML, XML or JSON.

    Args:
        path: a file, or the folder of `rig.yml` or of the stereo sample's two files.

    Raises:
        FormatError: a field is missing or odd, or one of the two files is missing.
        StoreError: a file cannot be read.
    """
    if path.is_dir():
        sample = [_present(path, name) for name in _SAMPLE]
        path = next(
            (file for file in (_present(path, FILE), *sample) if file is not None), path / FILE
        )
    root = _read(path)
    if "views" in root:
        return _rig_of(root, path)
    if holds_pair(root):
        other = path if holds_place(root) else _beside(path, _SAMPLE)
        return pair_of(root, root if other == path else _read(other), path, other)
    if holds_place(root):
        other = _beside(path, (_SAMPLE[1], _SAMPLE[0]))
        return pair_of(_read(other), root, other, path)
    if holds_one(root):
        return one_of(root, path)
    there = ", ".join(str(key)[:40] for key in list(root)[:8]) or "nothing"
    raise FormatError(
        f"{path}: holds {there}, but no cameras",
        advice="expected M1, D1, M2, D2 with R and T beside, or camera_matrix and "
        "distortion_coefficients, written by cv2.FileStorage",
    )


def _beside(path: Path, names: tuple[str, str]) -> Path:
    """The other file of the stereo sample.

    Raises:
        FormatError: it is missing.
    """
    missing = names[1]
    found = _present(path.parent, missing)
    if found is None:
        needed = "where the cameras stand" if missing == _SAMPLE[1] else "what the cameras are"
        raise FormatError(
            f"{path.parent}: holds {path.name} without {missing}, which says {needed}",
            advice=f"put {missing} of the same stereo calibration beside it",
        )
    return found


def _rig_of(root: fields.Fields, path: Path) -> RigGeometry:
    reference = fields.text(root, "reference", str(path))
    views = fields.field(root, "views", str(path))
    if not isinstance(views, list) or not views:
        raise FormatError(f"{path}: has no list of views")
    names: list[str] = []
    cameras: list[CameraModel] = []
    poses: list[Pose] = []
    for i, view in enumerate(cast("list[object]", views)):
        where = f"{path}: view {i}"
        node = fields.mapping(view, where)
        names.append(fields.text(node, "name", where))
        cameras.append(_camera(node, where))
        rotation = array(node, "rotation", (3, 3), where)
        translation_mm = array(node, "translation_mm", (3, 1), where).ravel().tolist()
        poses.append(fields.pose(rotation, translation_mm, where))
    if reference not in names:
        raise FormatError(f"{path}: reference {reference} is none of {', '.join(names)}")
    return RigGeometry(tuple(names), names.index(reference), tuple(cameras), tuple(poses))


def _present(folder: Path, name: str) -> Path | None:
    """A file as YAML or as XML, whichever is there."""
    paths = (folder / name, (folder / name).with_suffix(".xml"))
    return next((path for path in paths if path.exists()), None)


def _read(path: Path) -> fields.Fields:
    """The fields of a file, in the form that its first sign shows."""
    match read_text(path).lstrip("\ufeff \t\r\n")[:1]:
        case "<":
            return read_xml(path)
        case "{":
            return fields.read_json(path)
        case _:
            return fields.read_yaml(path, _Loader)


def _write_one(camera: CameraModel, folder: Path) -> None:
    """Write one camera as OpenCV's calibration sample does, which most programs read."""
    storage = cv2.FileStorage(_ONE, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("image_width", camera.width_px)
    storage.write("image_height", camera.height_px)
    storage.write("fisheye_model", int(camera.lens == "fisheye"))
    storage.write("camera_matrix", camera.matrix)
    storage.write("distortion_coefficients", _row(camera).T)
    write_bytes(folder / _ONE, storage.releaseAndGetString().encode())


def _write_sample(geometry: RigGeometry, folder: Path) -> None:
    one, two = geometry.cameras
    two_from_one = geometry.cam_from_reference[1] @ geometry.cam_from_reference[0].inverse()
    intrinsics: dict[str, Float] = {
        "M1": one.matrix, "D1": _row(one), "M2": two.matrix, "D2": _row(two),
    }  # fmt: skip
    extrinsics: dict[str, Float] = {
        "R": two_from_one.rotation, "T": two_from_one.translation_mm.reshape(3, 1),
    }  # fmt: skip
    for name, matrices in zip(_SAMPLE, (intrinsics, extrinsics), strict=True):
        storage = cv2.FileStorage(name, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
        for key, value in matrices.items():
            storage.write(key, value)
        write_bytes(folder / name, storage.releaseAndGetString().encode())


def _camera(node: fields.Fields, where: str) -> CameraModel:
    matrix = array(node, "camera_matrix", (3, 3), where)
    fields.require_no_skew(matrix, f"{where} camera_matrix")
    model = fields.text(node, "distortion_model", where)
    coefficients = flat(node, "distortion_coefficients", where)
    lens: LensModel
    match model:
        case "none":
            lens, coefficients = "none", []
        case "brown5" | "brown8" | "fisheye":
            lens = model
            coefficients = coefficients[: COEFFICIENTS[lens]]
        case _:
            raise FormatError(f"{where}: distortion_model {model} is not known here")
    size = tuple(
        fields.size_px(fields.field(node, name, where), f"{where} {name}")
        for name in ("image_width", "image_height")
    )
    return fields.camera((size[0], size[1]), fields.of_matrix(matrix), lens, coefficients, where)


def _row(camera: CameraModel) -> Float:
    return np.array([camera.coefficients or (0.0,) * 5])


class _Loader(BoundedLoader):
    """Knows OpenCV's matrices: a mapping with rows, cols, dt and data."""


_Loader.add_constructor(
    "tag:yaml.org,2002:opencv-matrix",
    lambda loader, node: loader.construct_mapping(cast("yaml.MappingNode", node), deep=True),
)


@dataclass(frozen=True, slots=True)
class OpencvExport(GeometryExport):
    """Writes a calibration for OpenCV FileStorage."""

    format: ClassVar = GeometryFormat(
        "opencv",
        "OpenCV FileStorage",
        "",
        ("none", "brown5", "brown8", "fisheye"),
        write,
        read,
        unit_mm=1.0,
        comments=(FILE, *_SAMPLE),
    )
