"""Kalibr `camchain.yaml`: one chain of cameras, each placed relative to the one before it.

Lengths in m; `T_cn_cnm1` takes points of camera n - 1 into camera n. Chains of an IMU calibration
may hold `T_cam_imu` instead, from the IMU into each camera. Lens models: `radtan` (k1, k2, p1, p2),
`equidistant` (four fisheye terms), `none`. Format: Kalibr wiki, "Yaml formats".
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import yaml

from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.export.lens_change import exact_lens
from rig.files import write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_MODELS: dict[str, tuple[LensModel, int]] = {
    "radtan": ("brown5", 4),
    "equidistant": ("fisheye", 4),
    "none": ("none", 0),
}
_TOPIC = re.compile(r"^/([A-Za-z0-9_-]+)/image_raw$")


def write(geometry: RigGeometry, path: Path) -> None:
    """Write all views as one chain, in their order.

    Raises:
        FormatError: a lens has terms that Kalibr does not know (k3 and above).
        StoreError: the file cannot be written.
    """
    chain: dict[str, object] = {}
    before = Pose.identity()
    for n, (name, camera, pose) in enumerate(
        zip(geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True)
    ):
        model, coefficients = _lens(name, camera)
        entry: dict[str, object] = {
            "camera_model": "pinhole",
            "intrinsics": [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px],
            "distortion_model": model,
            "distortion_coeffs": coefficients,
            "resolution": [camera.width_px, camera.height_px],
            "rostopic": f"/{name}/image_raw",
        }
        if n > 0:
            step = pose @ before.inverse()
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = step.rotation, step.translation_mm / 1000.0
            entry["T_cn_cnm1"] = matrix.tolist()
        before = pose
        chain[f"cam{n}"] = entry
    write_bytes(path, yaml.safe_dump(chain, sort_keys=False, default_flow_style=None).encode())


def read(path: Path) -> RigGeometry:
    """Read a chain; its first camera becomes the reference.

    A view is called after its topic `/NAME/image_raw` where it has one, else `camN`.

    Raises:
        FormatError: a field is missing or odd, or a camera model is not known here.
        StoreError: the file cannot be read.
    """
    chain = fields.read_yaml(path)
    names: list[str] = []
    cameras: list[CameraModel] = []
    poses = [Pose.identity()]
    before: fields.Fields = {}
    for n in range(len(chain)):
        where = f"{path}: cam{n}"
        entry = fields.mapping(fields.field(chain, f"cam{n}", str(path)), where)
        cameras.append(_camera(entry, where))
        names.append(_name(entry, n))
        if n > 0:
            poses.append(_step(entry, before, where) @ poses[-1])
        before = entry
    if not cameras:
        raise FormatError(f"{path}: holds no camera", advice="expected cam0, cam1 and so on")
    return RigGeometry(tuple(names), 0, tuple(cameras), tuple(poses))


def _lens(name: str, camera: CameraModel) -> tuple[str, list[float]]:
    match camera.lens:
        case "none":
            return "none", []
        case "fisheye":
            return "equidistant", list(camera.coefficients)
        case "brown5" | "brown8":
            exact = exact_lens(camera, "brown4", view=name, tool="Kalibr")
            return "radtan", list(exact)


def _camera(entry: fields.Fields, where: str) -> CameraModel:
    projection = fields.text(entry, "camera_model", where)
    model = fields.text(entry, "distortion_model", where)
    if projection != "pinhole" or model not in _MODELS:
        raise FormatError(
            f"{where}: camera model {projection} with {model} is not known here",
            advice=f"known are pinhole with {', '.join(_MODELS)}: calibrate again in Kalibr with "
            "--models pinhole-radtan or pinhole-equi",
        )
    lens, count = _MODELS[model]
    coefficients = fields.numbers(
        fields.field(entry, "distortion_coeffs", where), f"{where} distortion_coeffs", count=count
    )
    if lens == "brown5":
        coefficients.append(0.0)
    size = fields.field(entry, "resolution", where)
    width, height = (
        fields.size_px(n, f"{where} resolution") for n in fields.numbers(size, where, count=2)
    )
    intrinsics = fields.four(fields.field(entry, "intrinsics", where), f"{where} intrinsics")
    return fields.camera((width, height), intrinsics, lens, coefficients, where)


def _step(entry: fields.Fields, before: fields.Fields, where: str) -> Pose:
    """The place of a camera beside the one before it; by an IMU where only that is told."""
    by_imu = "T_cam_imu"
    if "T_cn_cnm1" not in entry and by_imu in entry and by_imu in before:
        one, other = (_motion(camera, by_imu, where) for camera in (before, entry))
        return other @ one.inverse()
    return _motion(entry, "T_cn_cnm1", where)


def _motion(entry: fields.Fields, name: str, where: str) -> Pose:
    matrix = fields.matrix(fields.field(entry, name, where), (4, 4), f"{where} {name}")
    return fields.pose(matrix[:3, :3], (1000.0 * matrix[:3, 3]).tolist(), f"{where} {name}")


def _name(entry: fields.Fields, n: int) -> str:
    topic = entry.get("rostopic")
    known = _TOPIC.match(topic) if isinstance(topic, str) else None
    return known.group(1) if known else f"cam{n}"


@dataclass(frozen=True, slots=True)
class KalibrExport(GeometryExport):
    """Writes a calibration for Kalibr camchain."""

    format: ClassVar = GeometryFormat(
        "kalibr",
        "Kalibr camchain",
        "camchain.yaml",
        ("none", "brown4", "fisheye"),
        write,
        read,
        comments=("camchain.yaml",),
    )
