"""Cameras in files of OpenCV's FileStorage as its samples and other people name their fields.

A pair: M1, D1, M2, D2 with R, T of the second camera from the first, in one file or in two as the
stereo calibration sample writes them. One camera: as the camera calibration sample writes it. A
picture size that is not told is taken as twice the principal point. The unit of lengths is that in
which the squares of the board were given; taken as mm.
"""

from pathlib import Path

import numpy as np

from rig.arrays import Float
from rig.export import fields
from rig.export.opencv_lens import fisheye_lens, opencv_lens
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

_PAIRS = (
    ("M1", "D1", "M2", "D2"),
    ("K1", "D1", "K2", "D2"),
    ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"),
    ("K_LEFT", "D_LEFT", "K_RIGHT", "D_RIGHT"),
    ("K_LEFT", "D_LEFT_FE", "K_RIGHT", "D_RIGHT_FE"),
)
"""Names of matrices and lenses; those that end in FE are fisheyes."""
_ALONE = (
    ("camera_matrix", "distortion_coefficients"),
    ("Camera_Matrix", "Distortion_Coefficients"),
    ("cameraMatrix", "distCoeffs"),
    ("K", "D"),
)
_SIZES = ("Size", "image_size", "imageSize", "ImageSize")
_SIDES = (("image_width", "image_height"), ("image_Width", "image_Height"), ("width", "height"))


def holds_pair(root: fields.Fields) -> bool:
    """Say whether the cameras of a pair are told."""
    return _first(root, _PAIRS) is not None


def holds_place(root: fields.Fields) -> bool:
    """Say whether it is told where the second camera stands."""
    return {"R", "T"} <= root.keys()


def holds_one(root: fields.Fields) -> bool:
    """Say whether one camera is told."""
    return _first(root, _ALONE) is not None


def pair_of(inside: fields.Fields, outside: fields.Fields, inner: Path, outer: Path) -> RigGeometry:
    """Return the pair, called left and right.

    Args:
        inside: what tells the cameras.
        outside: what tells the place of the second; may be the same.
        inner: file of `inside`.
        outer: file of `outside`.

    Raises:
        FormatError: a field is missing or odd.
    """
    one, lens_one, two, lens_two = _first(inside, _PAIRS) or _PAIRS[0]
    where = f"{outer}: T"
    moved_mm = array(outside, "T", (3, 1), str(outer)).ravel().tolist()
    turn = flat(outside, "R", str(outer))
    if len(turn) == 3:
        place = fields.turned(turn, moved_mm, where)
    else:
        place = fields.pose(array(outside, "R", (3, 3), str(outer)), moved_mm, where)
    cameras = (
        _camera(inside, one, lens_one, f"{inner}: camera 1"),
        _camera(inside, two, lens_two, f"{inner}: camera 2"),
    )
    return RigGeometry(("left", "right"), 0, cameras, (Pose.identity(), place))


def one_of(root: fields.Fields, file: Path) -> RigGeometry:
    """Return the one camera of a file, called after the file.

    Raises:
        FormatError: a field is missing or odd.
    """
    matrix, lens = _first(root, _ALONE) or _ALONE[0]
    is_fisheye = bool(fields.number(root.get("fisheye_model", 0), f"{file}: fisheye_model"))
    camera = _camera(root, matrix, lens, str(file), is_fisheye=is_fisheye)
    return RigGeometry((file.stem,), 0, (camera,), (Pose.identity(),))


def flat(node: fields.Fields, name: str, where: str) -> list[float]:
    """Return the numbers of a matrix, row by row.

    Raises:
        FormatError: it is missing or no matrix of numbers.
    """
    matrix = fields.mapping(fields.field(node, name, where), f"{where} {name}")
    return fields.numbers(fields.field(matrix, "data", f"{where} {name}"), f"{where} {name}")


def array(node: fields.Fields, name: str, shape: tuple[int, int], where: str) -> Float:
    """Return a matrix of a shape.

    Raises:
        FormatError: it is missing, or of another size.
    """
    numbers = fields.numbers(flat(node, name, where), f"{where} {name}", count=shape[0] * shape[1])
    return np.array(numbers).reshape(shape)


def _first(root: fields.Fields, names: tuple[tuple[str, ...], ...]) -> tuple[str, ...] | None:
    return next((known for known in names if set(known) <= root.keys()), None)


def _camera(
    root: fields.Fields, matrix: str, lens: str, where: str, *, is_fisheye: bool = False
) -> CameraModel:
    inside = array(root, matrix, (3, 3), where)
    fields.require_no_skew(inside, f"{where} {matrix}")
    coefficients = flat(root, lens, where)
    is_fisheye = is_fisheye or lens.endswith("_FE")
    model, taken = (fisheye_lens if is_fisheye else opencv_lens)(coefficients, where)
    return fields.camera(_size(root, inside, where), fields.of_matrix(inside), model, taken, where)


def _size(root: fields.Fields, matrix: Float, where: str) -> tuple[int, int]:
    told: object = [float(np.rint(2.0 * centre)) for centre in matrix[:2, 2]]
    for name in _SIZES:
        told = root.get(name, told)
    for names in _SIDES:
        if set(names) <= root.keys():
            told = [root[name] for name in names]
    width, height = fields.numbers(told, f"{where} picture size", count=2)
    return fields.size_px(width, where), fields.size_px(height, where)
