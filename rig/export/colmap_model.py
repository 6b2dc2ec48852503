"""What a COLMAP model says of cameras and images, as plain values, and what its cameras are here.

COLMAP puts pixel (0, 0)'s corner, not its centre, at the origin: principal points are half a pixel
larger there. Format: COLMAP documentation, "Camera Models".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rig.errors import FormatError
from rig.export import fields
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel

HALF_PX = 0.5
MOST_IMAGES = 1_000
MOST_CAMERAS = 1_000


@dataclass(frozen=True, slots=True)
class ColmapModel:
    """One of COLMAP's camera models."""

    lens: LensModel
    count: int
    """Of its parameters."""
    one_focal_length: bool = False


MODELS: Mapping[str, ColmapModel] = {
    "SIMPLE_PINHOLE": ColmapModel("none", 3, one_focal_length=True),
    "PINHOLE": ColmapModel("none", 4),
    "SIMPLE_RADIAL": ColmapModel("brown5", 4, one_focal_length=True),
    "RADIAL": ColmapModel("brown5", 5, one_focal_length=True),
    "OPENCV": ColmapModel("brown5", 8),
    "FULL_OPENCV": ColmapModel("brown8", 12),
    "OPENCV_FISHEYE": ColmapModel("fisheye", 8),
    "SIMPLE_FISHEYE": ColmapModel("fisheye", 3, one_focal_length=True),
    "FISHEYE": ColmapModel("fisheye", 4),
    "SIMPLE_RADIAL_FISHEYE": ColmapModel("fisheye", 4, one_focal_length=True),
    "RADIAL_FISHEYE": ColmapModel("fisheye", 5, one_focal_length=True),
}
"""Those that are read; coefficients that a model does not name are zero."""
_COUNTS: Mapping[LensModel, int] = {"none": 0, "brown5": 5, "brown8": 8, "fisheye": 4}


@dataclass(frozen=True, slots=True)
class ColmapCamera:
    """A camera as the file has it."""

    model: str
    width_px: int
    height_px: int
    parameters: Sequence[float]


@dataclass(frozen=True, slots=True)
class ColmapImage:
    """An image as the file has it, placed from the world into the camera."""

    name: str
    camera: int
    quaternion: Sequence[float]
    """w, x, y, z."""
    translation: Sequence[float]
    """In the model's own unit."""


def unknown_model(name: str, where: str) -> FormatError:
    """Return the refusal of a camera model."""
    return FormatError(
        f"{where}: camera model {name} is not known here",
        advice=f"known are {', '.join(MODELS)}; refine with one of these in COLMAP "
        "(Bundle adjustment, or --ImageReader.camera_model OPENCV)",
    )


def camera_of(camera: ColmapCamera, where: str) -> CameraModel:
    """Return a camera of a model as one of a rig.

    Raises:
        FormatError: the model is not known here, or its parameters are odd.
    """
    model = MODELS.get(camera.model)
    if model is None:
        raise unknown_model(camera.model[:40], where)
    parameters = fields.numbers(camera.parameters, where, count=model.count)
    if model.one_focal_length:
        parameters = [parameters[0], *parameters]
    lens, coefficients = model.lens, parameters[4:]
    coefficients += [0.0] * (_COUNTS[lens] - len(coefficients))
    if lens == "brown8" and not any(coefficients[5:]):
        lens, coefficients = "brown5", coefficients[:5]
    fx, fy, cx, cy = parameters[:4]
    return fields.camera(
        (camera.width_px, camera.height_px),
        (fx, fy, cx - HALF_PX, cy - HALF_PX), lens, coefficients, where,
    )  # fmt: skip
