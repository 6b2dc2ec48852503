"""The binary calibration of DepthAI's first generation (version 5), as `depthai.calib` holds it.

111 single-precision numbers, little-endian: two rectifying rotations, matrices of the left and the
right camera, rotation and translation (cm) from left to right, matrix of the colour camera, its
rotation and translation, and three lenses of 14. Sizes are those of that generation. Which
socket is which stands in a separate description of the board; views are called left, right and rgb.
Format: DepthAI's `CalibrationHandler(calibrationDataPath, boardConfigPath)`.
"""

from pathlib import Path

import numpy as np

from rig.errors import FormatError
from rig.export import fields
from rig.export.opencv_lens import opencv_lens
from rig.files import read_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

BYTES = 444
_NAMES = ("left", "right", "rgb")
_SIZES_PX = ((1280, 800), (1280, 800), (1920, 1080))
_MATRICES = (18, 27, 48)
_LENSES = (69, 83, 97)
_LENS = 14
_MM_PER_CM = 10.0


def read(path: Path) -> RigGeometry:
    """Read the file; the right camera is the reference, from which both others are told.

    Raises:
        FormatError: it is no such file.
        StoreError: it cannot be read.
    """
    content = read_bytes(path, most=BYTES)
    if len(content) != BYTES:
        raise FormatError(f"{path}: is no calibration of DepthAI of {BYTES} bytes")
    numbers = fields.numbers(np.frombuffer(content, "<f4").astype(np.float64).tolist(), str(path))
    cameras = [
        _camera(numbers, name, size, matrix, lens, path)
        for name, size, matrix, lens in zip(_NAMES, _SIZES_PX, _MATRICES, _LENSES, strict=True)
    ]
    right_from_left = _pose(numbers, 36, 45, f"{path}: left")
    # DepthAI turns this rotation round for the way from right to colour, and takes the translation
    # against its sign.
    told = _pose(numbers, 57, 66, f"{path}: rgb")
    rgb_from_right = Pose(told.rotation.T, -told.translation_mm)
    poses = (right_from_left.inverse(), Pose.identity(), rgb_from_right)
    return RigGeometry(_NAMES, 1, tuple(cameras), poses)


def _camera(
    numbers: list[float], name: str, size: tuple[int, int], matrix_at: int, lens_at: int, path: Path
) -> CameraModel:  # fmt: skip
    where = f"{path}: {name}"
    matrix = np.array(numbers[matrix_at : matrix_at + 9]).reshape(3, 3)
    fields.require_no_skew(matrix, where)
    lens, coefficients = opencv_lens(numbers[lens_at : lens_at + _LENS], where)
    return fields.camera(size, fields.of_matrix(matrix), lens, coefficients, where)


def _pose(numbers: list[float], rotation_at: int, translation_at: int, where: str) -> Pose:
    rotation = np.array(numbers[rotation_at : rotation_at + 9]).reshape(3, 3)
    moved_mm = [_MM_PER_CM * n for n in numbers[translation_at : translation_at + 3]]
    return fields.pose(rotation, moved_mm, where)
