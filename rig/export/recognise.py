"""Whose calibration a file or folder is, by what it holds: names of files say little.

Also knows what people give by mistake, and how each becomes a file that is read.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rig.errors import FormatError, StoreError
from rig.export import oak_gen1
from rig.export.formats import formats_of
from rig.files import read_bytes

_LOOKED_AT_BYTES = 200_000
"""Of every file: each of these formats shows itself in its first lines."""
_MOST_FILES = 200
"""Of a folder; a calibration has one file per view at most."""


@dataclass(frozen=True, slots=True)
class _Sign:
    """How a text shows whose it is."""

    name: str
    pattern: re.Pattern[str]


@dataclass(frozen=True, slots=True)
class _Foreign:
    """What is not read, and how it becomes something that is."""

    what: str
    pattern: re.Pattern[bytes]
    advice: str


def _sign(name: str, pattern: str) -> _Sign:
    return _Sign(name, re.compile(pattern, re.MULTILINE))


def _foreign(what: str, pattern: bytes, advice: str) -> _Foreign:
    return _Foreign(what, re.compile(pattern, re.MULTILINE), advice)


_SIGNS = (
    _sign("opencv", r"\A%YAML:1\.0|<opencv_storage|opencv-matrix"),
    _sign("depthai", r'"cameraData"\s*:'),
    _sign("mrcal", r"['\"]lensmodel['\"]\s*:"),
    _sign("zed", r"^\[(?:LEFT|RIGHT)_CAM_[A-Z0-9]+\]"),
    _sign("caliscope", r"^[ \t]*(?:\[cameras\.\"?\d+\"?\]|rotation_count[ \t]*=)"),
    _sign("anipose", r"^[ \t]*distortions[ \t]*="),
    _sign("kalibr", r"^cam0[ \t]*:"),
    _sign("ros", r"^(?:camera_matrix|camera_name|distortion_model)[ \t]*:"),
    _sign("colmap", r"^[ \t]*\d+ [A-Z_]{3,40} \d+ \d+ "),
)
"""In this order: the first that fits."""
_OTHERS = (
    _foreign(
        "a target of Kalibr, no calibration", rb"^target_type[ \t]{0,20}:",
        "take it into a new profile: rig profile new NAME --target FILE",
    ),
    _foreign(
        "a MATLAB workspace", rb"\AMATLAB 5\.0 MAT-file|\A\x89HDF",
        "write it with MATLAB's stereoParametersToOpenCV and OpenCV's FileStorage",
    ),
    _foreign(
        "arrays of NumPy, or another ZIP archive", rb"\A\x93NUMPY|\APK\x03\x04",
        "write M1, D1, M2, D2 and R, T with cv2.FileStorage as intrinsics.yml and extrinsics.yml",
    ),
    _foreign(
        "a pickle of Python, which can hold any program", rb"\A\x80[\x02-\x05]",
        "load it where it was made, and write M1, D1, M2, D2, R, T with cv2.FileStorage",
    ),
    _foreign(
        "a project or camera of Agisoft Metashape",
        rb"<document[^>]{0,200}>\s{0,20}<chunk|<projection>frame",
        "export the cameras there as COLMAP (text or binary)",
    ),
    _foreign(
        "a calibration of Basalt", rb'"T_imu_cam"\s*:',
        "convert it to a Kalibr camchain with pinhole-radtan or pinhole-equi",
    ),
    _foreign(
        "a calibration of multical", rb'"camera_poses"\s*:',
        "write its K, dist and poses with cv2.FileStorage, or calibrate the pictures here",
    ),
    _foreign(
        "the description of a DepthAI board, without a calibration",
        rb'\A(?![\s\S]*"cameraData")[\s\S]*"board(?:_config|Conf|Name)"\s*:',
        "give what the device itself holds, as `rig export` or DepthAI write it (cameraData)",
    ),
    _foreign(
        "a CAHVOR model", rb"^[ \t]{0,20}Model[ \t]{0,20}=[ \t]{0,20}CAHVOR",
        "convert it: mrcal-to-cameramodel FILE, then mrcal-convert-lensmodel LENSMODEL_OPENCV8",
    ),
    _foreign(
        "a calibration of librealsense", rb'"rectified\.0\.fx"',
        "calibrate the pictures of the device here, or publish them by its ROS driver and give "
        "the camera_info",
    ),
)  # fmt: skip


_FOLDERS = ("ros", "opencv", "mrcal", "colmap")
"""Formats of which one calibration can be several files; the others are one."""


@dataclass(frozen=True, slots=True)
class Recognised:
    """Whose calibration something is."""

    source: str
    """Name of its format."""
    path: Path
    """What the format's reader takes: the folder, or the one file in it."""


def recognise(path: Path) -> Recognised:
    """Return the format of a calibration.

    Args:
        path: file, or folder with one calibration.

    Raises:
        FormatError: it is none that is read, or a folder holds several.
        StoreError: it cannot be read.
    """
    if not path.is_dir():
        return Recognised(_of_file(path), path)
    if any((path / f"cameras{suffix}").exists() for suffix in (".txt", ".bin")):
        return Recognised("colmap", path)
    found: dict[str, list[Path]] = {}
    refused: FormatError | None = None
    for file in _files(path):
        try:
            found.setdefault(_of_file(file), []).append(file)
        except FormatError as error:
            refused = refused or error
        except StoreError:  # one that may not be read says nothing of the others
            continue
    if len(found) > 1:
        raise FormatError(
            f"{path}: holds calibrations of {' and '.join(found)} "
            f"({', '.join(files[0].name for files in found.values())})",
            advice="say which with --format, or give the one file",
        )
    if not found:
        raise refused or FormatError(f"{path}: holds no file", advice="give another folder")
    ((source, files),) = found.items()
    if len(files) > 1 and source not in _FOLDERS:
        raise FormatError(
            f"{path}: holds {len(files)} calibrations of {source} "
            f"({', '.join(file.name for file in files[:4])})",
            advice="give the one file",
        )
    return Recognised(source, files[0] if len(files) == 1 else path)


def _files(folder: Path) -> Iterator[Path]:
    there = sorted(path for path in folder.iterdir() if path.is_file())
    if len(there) > _MOST_FILES:
        raise FormatError(
            f"{folder}: holds {len(there)} files, a calibration {_MOST_FILES} at most",
            advice="put the calibration into a folder of its own",
        )
    yield from there


def _of_file(path: Path) -> str:
    content = read_bytes(path, most=_LOOKED_AT_BYTES)
    if path.name in ("cameras.bin", "images.bin"):
        return "colmap"
    if len(content) == oak_gen1.BYTES and b"\0" in content:
        return "depthai"
    for other in _OTHERS:
        if other.pattern.search(content):
            raise FormatError(f"{path}: is {other.what}, which is not read", advice=other.advice)
    text = content.decode(errors="replace").removeprefix("\ufeff")
    for sign in _SIGNS:
        if sign.pattern.search(text):
            return sign.name
    raise FormatError(
        f"{path}: is of none of the formats that are read ({', '.join(formats_of('geometry'))})",
        advice="say which it is with --format, or convert it to OpenCV's FileStorage",
    )
