"""OpenCV FileStorage YAML: all views in one file; a pair also as OpenCV's stereo sample has it.

Lengths in mm. `views` holds per view its name, picture size, camera matrix, distortion (OpenCV's
order) and model, and the rotation and translation that take points of the reference frame into the
camera. A folder with `intrinsics.yml` (M1, D1, M2, D2) and `extrinsics.yml` (R, T), as the stereo
calibration sample of OpenCV writes them, is read as a pair. One camera alone is also written as
`camera.yml`, as the calibration sample writes it.

OpenCV writes the files; reading is done here, because OpenCV's own parser can hang on damaged ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, cast

import cv2
import numpy as np
import yaml

from rig.arrays import Float
from rig.errors import FormatError
from rig.export import fields
from rig.export.bounded_yaml import BoundedLoader
from rig.export.geometry_format import GeometryExport, GeometryFormat
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


def read(folder: Path) -> RigGeometry:
    """Read `rig.yml` of a folder, or the two files of OpenCV's stereo sample; YAML or XML.

    The sample's files do not tell the picture size; it is taken as twice the principal point.

    Raises:
        FormatError: a field is missing or odd, or one of the two files is missing.
        StoreError: a file cannot be read.
    """
    path = _present(folder, FILE)
    if path is None:
        sample = [_present(folder, name) for name in _SAMPLE]
        if any(sample):
            return _read_sample(folder, sample)
        path = folder / FILE
    root = _read(path)
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
        rotation = _array(node, "rotation", (3, 3), where)
        translation_mm = _array(node, "translation_mm", (3, 1), where).ravel().tolist()
        poses.append(fields.pose(rotation, translation_mm, where))
    if reference not in names:
        raise FormatError(f"{path}: reference {reference} is none of {', '.join(names)}")
    return RigGeometry(tuple(names), names.index(reference), tuple(cameras), tuple(poses))


def _present(folder: Path, name: str) -> Path | None:
    """A file as YAML or as XML, whichever is there."""
    paths = (folder / name, (folder / name).with_suffix(".xml"))
    return next((path for path in paths if path.exists()), None)


def _read(path: Path) -> fields.Fields:
    return read_xml(path) if path.suffix == ".xml" else fields.read_yaml(path, _Loader)


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


def _read_sample(folder: Path, sample: Sequence[Path | None]) -> RigGeometry:
    inner, outer = sample
    if inner is None or outer is None:
        there, missing = _SAMPLE if outer is None else _SAMPLE[::-1]
        raise FormatError(
            f"{folder}: holds {there} without {missing}, which says "
            f"{'where the cameras stand' if outer is None else 'what the cameras are'}",
            advice=f"put {missing} of the same stereo calibration beside it",
        )
    inside, outside = _read(inner), _read(outer)
    cameras: list[CameraModel] = []
    for number in (1, 2):
        where = f"{inner}: camera {number}"
        matrix = _array(inside, f"M{number}", (3, 3), where)
        lens, coefficients = _lens(_flat(inside, f"D{number}", where), where)
        size = tuple(fields.size_px(float(np.rint(2.0 * c)), where) for c in matrix[:2, 2])
        cameras.append(
            fields.camera((size[0], size[1]), _intrinsics(matrix), lens, coefficients, where)
        )
    where = str(outer)
    rotation = _array(outside, "R", (3, 3), where)
    translation = _array(outside, "T", (3, 1), where).ravel().tolist()
    return RigGeometry(
        ("left", "right"), 0, tuple(cameras),
        (Pose.identity(), fields.pose(rotation, translation, where)),
    )  # fmt: skip


def _camera(node: fields.Fields, where: str) -> CameraModel:
    matrix = _array(node, "camera_matrix", (3, 3), where)
    model = fields.text(node, "distortion_model", where)
    coefficients = _flat(node, "distortion_coefficients", where)
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
    return fields.camera((size[0], size[1]), _intrinsics(matrix), lens, coefficients, where)


def _lens(flat: list[float], where: str) -> tuple[LensModel, list[float]]:
    """Brown-Conrady lens of OpenCV's 0, 4, 5, 8 (or 12, 14 with zeros) coefficients."""
    if any(flat[8:]):
        raise FormatError(f"{where}: has a thin-prism or tilted lens, which is not known here")
    wanted = flat[:8] + [0.0] * (8 - len(flat))
    return ("brown8", wanted) if any(wanted[5:]) else ("brown5", wanted[:5])


def _row(camera: CameraModel) -> Float:
    return np.array([camera.coefficients or (0.0,) * 5])


def _intrinsics(matrix: Float) -> tuple[float, float, float, float]:
    return float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])


def _flat(node: fields.Fields, name: str, where: str) -> list[float]:
    matrix = fields.mapping(fields.field(node, name, where), f"{where} {name}")
    return fields.numbers(fields.field(matrix, "data", f"{where} {name}"), f"{where} {name}")


def _array(node: fields.Fields, name: str, shape: tuple[int, int], where: str) -> Float:
    flat = fields.numbers(_flat(node, name, where), f"{where} {name}", count=shape[0] * shape[1])
    return np.array(flat).reshape(shape)


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
        "opencv", "OpenCV FileStorage", "", ("none", "brown5", "brown8", "fisheye"), write, read
    )
