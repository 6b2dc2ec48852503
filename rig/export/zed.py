"""The factory's calibration of a ZED, `SN12345.conf`; read only.

One section per side and resolution (`LEFT_CAM_HD`, `RIGHT_CAM_2K` ...) holds focal lengths,
principal point and OpenCV's lens; the numbers of a fisheye stand in k1, k2, k3, k4, with p1 = p2
= 0. `STEREO` holds the way to the right camera in mm, with the amount of its x, and its turn as a
Rodrigues vector (RX, CV, RZ), both as OpenCV's stereo calibration has them. Sizes are those of the
device. Format: Stereolabs, samples zed-opencv-native and zed-opencv-calibration.
"""

import configparser
import re
from collections.abc import Mapping
from pathlib import Path

from rig.bounded_text import read_text
from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryFormat
from rig.export.opencv_lens import fisheye_lens, opencv_lens
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_SECTION = re.compile(r"(LEFT|RIGHT)_CAM_([A-Z0-9]+)")
_SIZES_PX: Mapping[str, tuple[int, int]] = {
    "2K": (2208, 1242),
    "FHD": (1920, 1080),
    "FHD1200": (1920, 1200),
    "HD": (1280, 720),
    "SVGA": (960, 600),
    "VGA": (672, 376),
}
_MOST_BYTES = 100_000
_LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")


def read(path: Path) -> RigGeometry:
    """Read both cameras at every resolution; views are called as the sections, LEFT_CAM_HD first.

    Raises:
        FormatError: it is no such file, or a number is missing or odd.
        StoreError: the file cannot be read.
    """
    content = _sections(path)
    sides = {name: (found[1], found[2]) for name in content if (found := _SECTION.fullmatch(name))}
    unknown = sorted({size for _, size in sides.values()} - set(_SIZES_PX))
    if unknown:
        raise FormatError(
            f"{path}: has cameras {', '.join(unknown)}, whose picture size is not known here",
            advice=f"leave their sections out; known are {', '.join(_SIZES_PX)}",
        )
    if not sides or "STEREO" not in content:
        raise FormatError(
            f"{path}: has no sections LEFT_CAM_..., RIGHT_CAM_... and STEREO",
            advice="give the SN*.conf of a ZED",
        )
    cameras = {
        name: _camera(content[name], _SIZES_PX[size], f"{path}: {name}")
        for name, (_, size) in sides.items()
    }
    poses = {
        name: Pose.identity()
        if side == "LEFT"
        else _right(content["STEREO"], size, f"{path}: STEREO")
        for name, (side, size) in sides.items()
    }
    names = tuple(sides)
    reference = next((i for i, name in enumerate(names) if sides[name][0] == "LEFT"), None)
    if reference is None:
        raise FormatError(f"{path}: has no left camera")
    return RigGeometry(names, reference, tuple(cameras.values()), tuple(poses.values()))


def _sections(path: Path) -> dict[str, dict[str, str]]:
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(read_text(path, _MOST_BYTES))
    except configparser.Error as error:
        raise FormatError(
            f"{path}: is no ZED configuration: {' '.join(str(error).split())}",
            advice="give the SN*.conf of a ZED",
        ) from error
    return {name: dict(parser[name]) for name in parser.sections()}


def _camera(section: Mapping[str, str], size: tuple[int, int], where: str) -> CameraModel:
    intrinsics = [_number(section, name, where) for name in ("fx", "fy", "cx", "cy")]
    lens, coefficients = _lens([_number(section, name, where, 0.0) for name in _LENS], where)
    return fields.camera(size, fields.four(intrinsics, where), lens, coefficients, where)


def _lens(flat: list[float], where: str) -> tuple[LensModel, list[float]]:
    """A fisheye's where there is nothing but k1 to k4: by these the vendor's program tells it."""
    k1, k2, p1, p2, k3, k4, *further = flat
    is_fisheye = k3 and k4 and not any((p1, p2, *further))
    return fisheye_lens([k1, k2, k3, k4], where) if is_fisheye else opencv_lens(flat, where)


def _right(stereo: Mapping[str, str], size: str, where: str) -> Pose:
    """The right camera from the left one."""
    size = size.lower()
    turn = [_number(stereo, f"{axis}_{size}", where) for axis in ("rx", "cv", "rz")]
    rest_mm = [
        _number(stereo, f"{axis}_{size}" if f"{axis}_{size}" in stereo else axis, where, 0.0)
        for axis in ("ty", "tz")
    ]
    return fields.turned(turn, [-abs(_number(stereo, "baseline", where)), *rest_mm], where)


def _number(
    section: Mapping[str, str], name: str, where: str, absent: float | None = None
) -> float:
    if name not in section and absent is not None:
        return absent
    written = fields.text(section, name, where)
    try:
        return fields.number(float(written), f"{where} {name}")
    except ValueError as error:
        raise FormatError(f"{where}: {name} is {written[:40]!r}, expected a number") from error


FORMAT = GeometryFormat(
    "zed", "the factory's calibration of a ZED", "", (), None, read, unit_mm=1.0
)
