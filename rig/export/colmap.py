"""COLMAP models: `cameras`, `images`, `points3D` in one folder, one image per view.

Written as text, read as text or binary. Lengths in m. Format: COLMAP documentation, "Output
Format".
"""

from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import ClassVar

from rig.errors import FormatError
from rig.export import colmap_binary, colmap_text, fields
from rig.export.colmap_model import HALF_PX, camera_of
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.export.quaternion import quaternion_of
from rig.files import write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_FILES = ("cameras", "images")


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
        x, y, z, w = quaternion_of(pose.rotation)
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
    """Read a model, text or binary; the first image becomes the reference.

    Views are called after the images; where all of these have one name, after their folders. Also
    taken is one of the files, for the folder that it is in.

    Raises:
        FormatError: a file is not as it should be, or a camera model is not known here.
        StoreError: a file cannot be read.
    """
    folder = folder.parent if folder.is_file() else folder
    form = colmap_binary if _is_binary(folder) else colmap_text
    suffix = ".bin" if form is colmap_binary else ".txt"
    cameras_file, path = (folder / f"{name}{suffix}" for name in _FILES)
    cameras = {
        number: camera_of(camera, f"{cameras_file}: camera {number}")
        for number, camera in form.read_cameras(cameras_file).items()
    }
    images = form.read_images(path)
    names = _names([image.name for image in images], path)
    taken: list[CameraModel] = []
    poses: list[Pose] = []
    for image in images:
        where = f"{path}: image {image.name[:60]}"
        if image.camera not in cameras:
            raise FormatError(f"{where}: camera {image.camera} is not in {cameras_file.name}")
        taken.append(cameras[image.camera])
        w, x, y, z = image.quaternion
        moved_mm = [1000.0 * length for length in image.translation]
        poses.append(fields.quaternion([x, y, z, w], moved_mm, where))
    world_from_reference = poses[0].inverse()
    placed_poses = (Pose.identity(), *(pose @ world_from_reference for pose in poses[1:]))
    return RigGeometry(names, 0, tuple(taken), placed_poses)


def _is_binary(folder: Path) -> bool:
    """Whether a folder holds the binary form only."""
    return (folder / "cameras.bin").exists() and not (folder / "cameras.txt").exists()


def _names(images: list[str], path: Path) -> tuple[str, ...]:
    """Views of images such as left.png, or left/0001.png where files are called alike."""
    by_file = [PurePosixPath(name).stem for name in images]
    by_folder = [PurePosixPath(name).parent.name for name in images]
    names = by_file if len(set(by_file)) == len(images) else by_folder
    if not names or not all(names) or len(set(names)) != len(names):
        raise FormatError(
            f"{path}: holds {len(images)} images of {len(set(by_file))} views",
            advice="export a model with one image per view",
        )
    return tuple(names)


def _parameters(camera: CameraModel) -> tuple[str, list[float]]:
    pinhole = [camera.fx_px, camera.fy_px, camera.cx_px + HALF_PX, camera.cy_px + HALF_PX]
    match camera.lens:
        case "none":
            return "PINHOLE", pinhole
        case "fisheye":
            return "OPENCV_FISHEYE", [*pinhole, *camera.coefficients]
        case "brown5":
            return "FULL_OPENCV", [*pinhole, *camera.coefficients, 0.0, 0.0, 0.0]
        case "brown8":
            return "FULL_OPENCV", [*pinhole, *camera.coefficients]


@dataclass(frozen=True, slots=True)
class ColmapExport(GeometryExport):
    """Writes a calibration for COLMAP, as text."""

    format: ClassVar = GeometryFormat(
        "colmap",
        "COLMAP model",
        "",
        ("none", "brown5", "brown8", "fisheye"),
        write,
        read,
        comments=("cameras.txt",),
    )
