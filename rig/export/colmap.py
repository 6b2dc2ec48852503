"""COLMAP text model: `cameras.txt`, `images.txt`, `points3D.txt` in one folder, one image per view.

Lengths in m. COLMAP puts pixel (0, 0)'s corner, not its centre, at the origin: principal points are
half a pixel larger than here. Format: COLMAP documentation, "Output Format" and "Camera Models".
"""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig.bounded_text import read_text
from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.files import write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_HALF_PX = 0.5
_MOST_VIEWS = 1_000
_MODELS: dict[str, tuple[LensModel, int]] = {
    "SIMPLE_PINHOLE": ("none", 3),
    "PINHOLE": ("none", 4),
    "SIMPLE_RADIAL": ("brown5", 4),
    "RADIAL": ("brown5", 5),
    "OPENCV": ("brown5", 8),
    "FULL_OPENCV": ("brown8", 12),
    "OPENCV_FISHEYE": ("fisheye", 8),
}
"""Lens and number of parameters of each camera model that is read."""
_ONE_FOCAL_LENGTH = ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")


def write(geometry: RigGeometry, folder: Path) -> None:
    """Write the three files; images are called `NAME.png`, ids count from 1.

    Raises:
        StoreError: a file cannot be written.
    """
    cameras = ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[] (pixel centres at .5)"]
    images = ["# IMAGE_ID QW QX QY QZ TX TY TZ (m) CAMERA_ID NAME, then a line of its points"]
    for number, (name, camera, pose) in enumerate(
        zip(geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True), start=1
    ):
        model, parameters = _parameters(camera)
        cameras.append(
            f"{number} {model} {camera.width_px} {camera.height_px} "
            + " ".join(repr(float(p)) for p in parameters)
        )
        x, y, z, w = Rotation.from_matrix(pose.rotation).as_quat()
        placed = [w, x, y, z, *(pose.translation_mm / 1000.0)]
        images.append(f"{number} {' '.join(repr(float(p)) for p in placed)} {number} {name}.png")
        images.append("")
    for file, lines in (
        ("cameras.txt", cameras),
        ("images.txt", images),
        ("points3D.txt", ["# no points"]),
    ):
        write_bytes(folder / file, ("\n".join(lines) + "\n").encode())


def read(folder: Path) -> RigGeometry:
    """Read a model; the first image becomes the reference, views are called after the images.

    Raises:
        FormatError: a line is not as it should be, or a camera model is not known here.
        StoreError: a file cannot be read.
    """
    cameras = _read_cameras(folder / "cameras.txt")
    path = folder / "images.txt"
    names: list[str] = []
    taken: list[CameraModel] = []
    poses: list[Pose] = []
    # Every image has two lines, the second of which (its points) may be empty.
    lines = [line for line in read_text(path).splitlines() if not line.startswith("#")]
    if len(lines) > 2 * _MOST_VIEWS + 1:
        raise FormatError(
            f"{path}: holds {len(lines) // 2} images, rigs have {_MOST_VIEWS} views at most",
            advice="export the images of one instant",
        )
    for line in lines[::2]:
        words = line.split()
        if not words:
            continue
        where = f"{path}: image {words[0][:40]}"
        if len(words) < 10 or words[8] not in cameras:
            raise FormatError(f"{where}: expected 10 fields with a camera of cameras.txt")
        placed = _numbers(words[1:8], where)
        taken.append(cameras[words[8]])
        poses.append(_pose(placed, where))
        names.append(Path(" ".join(words[9:])).stem)
    if not names or len(set(names)) != len(names):
        raise FormatError(
            f"{path}: holds {len(names)} images of {len(set(names))} views",
            advice="expected one per view",
        )
    world_from_reference = poses[0].inverse()
    placed_poses = (Pose.identity(), *(pose @ world_from_reference for pose in poses[1:]))
    return RigGeometry(tuple(names), 0, tuple(taken), placed_poses)


def _parameters(camera: CameraModel) -> tuple[str, list[float]]:
    pinhole = [camera.fx_px, camera.fy_px, camera.cx_px + _HALF_PX, camera.cy_px + _HALF_PX]
    match camera.lens:
        case "none":
            return "PINHOLE", pinhole
        case "fisheye":
            return "OPENCV_FISHEYE", [*pinhole, *camera.coefficients]
        case "brown5":
            return "FULL_OPENCV", [*pinhole, *camera.coefficients, 0.0, 0.0, 0.0]
        case "brown8":
            return "FULL_OPENCV", [*pinhole, *camera.coefficients]


def _read_cameras(path: Path) -> dict[str, CameraModel]:
    cameras: dict[str, CameraModel] = {}
    lines = read_text(path).splitlines()
    if len(lines) > _MOST_VIEWS:
        raise FormatError(f"{path}: has {len(lines)} lines, rigs have {_MOST_VIEWS} views at most")
    for line in lines:
        words = line.split()
        if not words or line.startswith("#"):
            continue
        where = f"{path}: camera {words[0][:40]}"
        if len(words) < 4 or words[1] not in _MODELS:
            raise FormatError(
                f"{where}: camera model {words[1] if len(words) > 1 else 'none'} is not known here",
                advice=f"known are {', '.join(_MODELS)}; refine with one of these in COLMAP "
                "(Bundle adjustment, or --ImageReader.camera_model OPENCV)",
            )
        lens, count = _MODELS[words[1]]
        width, height = (fields.size_px(n, where) for n in _numbers(words[2:4], where))
        parameters = fields.numbers(_numbers(words[4:], where), where, count=count)
        if words[1] in _ONE_FOCAL_LENGTH:
            parameters = [parameters[0], *parameters]
        coefficients = parameters[4:]
        if lens == "brown5":  # k1, k2, p1, p2: what a model does not name is zero
            coefficients += [0.0] * (5 - len(coefficients))
        if lens == "brown8" and not any(coefficients[5:]):
            lens, coefficients = "brown5", coefficients[:5]
        fx, fy, cx, cy = parameters[:4]
        intrinsics = (fx, fy, cx - _HALF_PX, cy - _HALF_PX)
        cameras[words[0]] = fields.camera((width, height), intrinsics, lens, coefficients, where)
    return cameras


def _pose(placed: list[float], where: str) -> Pose:
    w, x, y, z = placed[:4]
    length = float(np.linalg.norm(placed[:4]))
    if not 0.99 < length < 1.01:
        raise FormatError(f"{where}: its quaternion has length {length:g}, expected 1")
    rotation: NDArray[np.float64] = Rotation.from_quat([x, y, z, w]).as_matrix()
    return Pose(rotation, 1000.0 * np.array(placed[4:]))


def _numbers(words: list[str], where: str) -> list[float]:
    try:
        return fields.numbers([float(word) for word in words], where)
    except ValueError as error:
        raise FormatError(f"{where}: expected numbers, found {' '.join(words)[:60]}") from error


@dataclass(frozen=True, slots=True)
class ColmapExport(GeometryExport):
    """Writes a calibration for COLMAP text model."""

    format: ClassVar = GeometryFormat(
        "colmap", "COLMAP text model", "", ("none", "brown5", "brown8", "fisheye"), write, read
    )
