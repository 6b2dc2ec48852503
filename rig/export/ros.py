"""ROS `camera_info` YAML: one file per view, and `transforms.yaml` with the places of all.

Lengths in m. `rectification_matrix` turns a camera into the rig's common frame; the projection
matrix of a rectified view carries -fx bx and -fy by of its place (bx, by) there. Distortion models
`plumb_bob` (5), `rational_polynomial` (8) and `equidistant` (4). Format: sensor_msgs/CameraInfo and
the camera_calibration_parsers of ROS. A projection matrix has no room for what a camera stands
before or behind the others; the transforms (geometry_msgs/TransformStamped) tell it exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, cast

import numpy as np
import yaml

from rig.arrays import Float
from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.export.quaternion import quaternion_of
from rig.files import write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rectification import rectify
from rig.geometry.rig_geometry import RigGeometry

TRANSFORMS = "transforms.yaml"

_MODEL_OF: dict[LensModel, str] = {
    "none": "plumb_bob",
    "brown5": "plumb_bob",
    "brown8": "rational_polynomial",
    "fisheye": "equidistant",
}
_LENSES: dict[str, tuple[LensModel, int]] = {
    "plumb_bob": ("brown5", 5),
    "rational_polynomial": ("brown8", 8),
    "equidistant": ("fisheye", 4),
}


def write(geometry: RigGeometry, folder: Path) -> None:
    """Write `NAME.yaml` per view and `transforms.yaml`; of one view alone its file.

    Raises:
        ConfigError: all views stand at one place.
        StoreError: a file cannot be written.
    """
    if len(geometry.names) == 1:
        _write_one(geometry.names[0], geometry.cameras[0], folder)
        return
    pitch_mm = float(np.linalg.norm(geometry.centres_mm(), axis=1).max())
    common = rectify(geometry, pitch_mm)
    for view, (name, camera) in enumerate(zip(geometry.names, geometry.cameras, strict=True)):
        turn, projection_m = common.camera_from_common(view).T, common.projection_m(view)
        _write(folder / f"{name}.yaml", _camera_info(name, camera, turn, projection_m))
    reference = geometry.names[geometry.reference]
    transforms = [
        _transform(reference, name, pose.inverse())
        for name, pose in zip(geometry.names, geometry.cam_from_reference, strict=True)
    ]
    _write(folder / TRANSFORMS, {"transforms": transforms})


def read(folder: Path) -> RigGeometry:
    """Read all `*.yaml` of a folder, or one file for a single view.

    Views are called after `camera_name`. Places come from `transforms.yaml`, else from
    rectification and projection matrices, where the first view without an offset is the reference.

    Raises:
        FormatError: there is none, or a field is missing or odd.
        StoreError: a file cannot be read.
    """
    if folder.is_file():
        entry, where = fields.read_yaml(folder), str(folder)
        name = fields.text(entry, "camera_name", where)
        return RigGeometry((name,), 0, (_camera(entry, where),), (Pose.identity(),))
    paths = sorted(
        path for path in (*folder.glob("*.yaml"), *folder.glob("*.yml")) if path.name != TRANSFORMS
    )
    if not paths:
        raise FormatError(
            f"{folder}: holds no camera_info *.yaml", advice="give the folder with one a view"
        )
    entries = [(fields.read_yaml(path), str(path)) for path in paths]
    names = tuple(fields.text(entry, "camera_name", where) for entry, where in entries)
    if len(set(names)) != len(names):
        raise FormatError(f"{folder}: two views have one camera_name: {', '.join(names)}")
    cameras = tuple(_camera(entry, where) for entry, where in entries)
    if (folder / TRANSFORMS).exists():
        reference, poses = _read_transforms(folder / TRANSFORMS, names)
    else:
        reference, poses = _from_projections(entries)
    return RigGeometry(names, reference, cameras, poses)


def _write_one(name: str, camera: CameraModel, folder: Path) -> None:
    """Write the one file of one camera alone: it is not turned, and keeps its focal length."""
    projection_m = np.concatenate([camera.matrix, np.zeros((3, 1))], axis=1)
    _write(folder / f"{name}.yaml", _camera_info(name, camera, np.eye(3), projection_m))


def _camera_info(
    name: str, camera: CameraModel, rectification: Float, projection_m: Float
) -> dict[str, object]:
    return {
        "image_width": camera.width_px,
        "image_height": camera.height_px,
        "camera_name": name,
        "camera_matrix": _matrix(camera.matrix),
        "distortion_model": _MODEL_OF[camera.lens],
        "distortion_coefficients": _matrix(np.array([camera.coefficients or (0.0,) * 5])),
        "rectification_matrix": _matrix(rectification),
        "projection_matrix": _matrix(projection_m),
    }


def _write(path: Path, content: dict[str, object]) -> None:
    write_bytes(path, yaml.safe_dump(content, sort_keys=False, default_flow_style=None).encode())


def _matrix(values: Float) -> dict[str, object]:
    rows, columns = values.shape
    return {"rows": rows, "cols": columns, "data": values.ravel().tolist()}


def _transform(parent: str, child: str, parent_from_child: Pose) -> dict[str, object]:
    quaternion = quaternion_of(parent_from_child.rotation)
    moved_m = (parent_from_child.translation_mm / 1000.0).tolist()
    return {
        "header": {"frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", moved_m, strict=True)),
            "rotation": dict(zip("xyzw", quaternion, strict=True)),
        },
    }


def _camera(entry: fields.Fields, where: str) -> CameraModel:
    model = fields.text(entry, "distortion_model", where)
    if model not in _LENSES:
        raise FormatError(
            f"{where}: distortion_model {model} is not known here",
            advice=f"known are {', '.join(_LENSES)}; calibrate again with one of these, e.g. by "
            "cameracalibrator of ROS",
        )
    lens, count = _LENSES[model]
    coefficients = _data(entry, "distortion_coefficients", None, where)
    if lens == "brown5" and len(coefficients) == 4:
        coefficients.append(0.0)  # older drivers leave k3 out
    coefficients = fields.numbers(coefficients, f"{where} distortion_coefficients", count=count)
    matrix = _data(entry, "camera_matrix", 9, where)
    size = tuple(
        fields.size_px(fields.field(entry, key, where), f"{where} {key}")
        for key in ("image_width", "image_height")
    )
    intrinsics = (matrix[0], matrix[4], matrix[2], matrix[5])
    return fields.camera((size[0], size[1]), intrinsics, lens, coefficients, where)


def _read_transforms(path: Path, names: Sequence[str]) -> tuple[int, tuple[Pose, ...]]:
    listed = fields.field(fields.read_yaml(path), "transforms", str(path))
    if not isinstance(listed, list):
        raise FormatError(f"{path}: transforms must be a list")
    found: dict[str, Pose] = {}
    parents: set[str] = set()
    for number, item in enumerate(cast("list[object]", listed)):
        where = f"{path}: transform {number}"
        entry = fields.mapping(item, where)
        header = fields.mapping(fields.field(entry, "header", where), where)
        parents.add(fields.text(header, "frame_id", where))
        motion = fields.mapping(fields.field(entry, "transform", where), where)
        shift, turn = (
            fields.mapping(fields.field(motion, key, where), where)
            for key in ("translation", "rotation")
        )
        quaternion = [fields.number(fields.field(turn, key, where), where) for key in "xyzw"]
        moved_mm = [1000.0 * fields.number(fields.field(shift, key, where), where) for key in "xyz"]
        child = fields.text(entry, "child_frame_id", where)
        found[child] = fields.quaternion(quaternion, moved_mm, where).inverse()
    parent = parents.pop() if len(parents) == 1 else ""
    missing = [name for name in names if name not in found and name != parent]
    if parent not in names or missing:
        raise FormatError(
            f"{path}: expected the place of every view in the frame of one of them, "
            f"missing are {', '.join(missing) or 'the parent'}"
        )
    poses = (Pose.identity() if name == parent else found[name] for name in names)
    return list(names).index(parent), tuple(poses)


def _from_projections(
    entries: Sequence[tuple[fields.Fields, str]],
) -> tuple[int, tuple[Pose, ...]]:
    cams_from_common: list[Pose] = []
    offsets: list[float] = []
    for entry, where in entries:
        turn = np.array(_data(entry, "rectification_matrix", 9, where)).reshape(3, 3)
        projection = np.array(_data(entry, "projection_matrix", 12, where)).reshape(3, 4)
        if not (projection[0, 0] > 0 and projection[1, 1] > 0):
            raise FormatError(f"{where}: projection_matrix has no focal length")
        x_m, y_m = -projection[0, 3] / projection[0, 0], -projection[1, 3] / projection[1, 1]
        common_from_cam = fields.pose(turn, [1000.0 * x_m, 1000.0 * y_m, 0.0], where)
        cams_from_common.append(common_from_cam.inverse())
        offsets.append(float(np.hypot(x_m, y_m)))
    reference = next((i for i, offset in enumerate(offsets) if offset < 1e-12), None)
    if reference is None:
        raise FormatError(f"{entries[0][1]}: no view has an offset of 0 in its projection_matrix")
    common_from_reference = cams_from_common[reference].inverse()
    return reference, tuple(
        Pose.identity() if i == reference else pose @ common_from_reference
        for i, pose in enumerate(cams_from_common)
    )


def _data(entry: fields.Fields, name: str, count: int | None, where: str) -> list[float]:
    matrix = fields.mapping(fields.field(entry, name, where), f"{where} {name}")
    values = fields.field(matrix, "data", f"{where} {name}")
    return fields.numbers(values, f"{where} {name}", count=count)


@dataclass(frozen=True, slots=True)
class RosExport(GeometryExport):
    """Writes a calibration for ROS camera_info."""

    format: ClassVar = GeometryFormat(
        "ros",
        "ROS camera_info",
        "",
        ("none", "brown5", "brown8", "fisheye"),
        write,
        read,
        comments=("{view}.yaml", TRANSFORMS),
    )
