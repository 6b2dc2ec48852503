"""A rig's geometry as JSON: versioned, closed, and equal to the last digit when it comes back."""

import math
from collections.abc import Mapping
from typing import Any, cast, get_args

import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry

VERSION = 1
"""Of the JSON; a reader refuses any other."""

_GEOMETRY = ("version", "names", "reference", "cameras", "poses", "covariance", "stage")
_CAMERA = ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "lens", "coefficients")
_POSE = ("rotation", "translation_mm")
_STAGE = ("axis", "scale", "zero_mm", "covariance")


def geometry_to_json(geometry: RigGeometry) -> dict[str, Any]:
    """Return a plain dict of numbers, strings and lists; `geometry_from_json` takes it back."""
    stage = geometry.stage
    return {
        "version": VERSION,
        "names": list(geometry.names),
        "reference": geometry.reference,
        "cameras": [
            {
                "width_px": camera.width_px,
                "height_px": camera.height_px,
                "fx_px": camera.fx_px,
                "fy_px": camera.fy_px,
                "cx_px": camera.cx_px,
                "cy_px": camera.cy_px,
                "lens": camera.lens,
                "coefficients": list(camera.coefficients),
            }
            for camera in geometry.cameras
        ],
        "poses": [
            {"rotation": pose.rotation.tolist(), "translation_mm": pose.translation_mm.tolist()}
            for pose in geometry.cam_from_reference
        ],
        "covariance": None if geometry.covariance is None else geometry.covariance.tolist(),
        "stage": None
        if stage is None
        else {
            "axis": stage.axis.tolist(),
            "scale": stage.scale,
            "zero_mm": stage.zero_mm,
            "covariance": stage.covariance.tolist(),
        },
    }


def geometry_from_json(content: Mapping[str, Any]) -> RigGeometry:
    """Build the geometry that `geometry_to_json` wrote.

    Raises:
        ConfigError: another version, unknown or missing names, or numbers that make no rig.
    """
    version = content.get("version")
    if version != VERSION:
        raise ConfigError(
            f"a stored calibration has version {version!r}, this program reads {VERSION}",
            advice="calibrate again, or use the version of rig that wrote it",
        )
    _require(content, _GEOMETRY, "geometry")
    try:
        names = tuple(_text(name) for name in content["names"])
        cameras = tuple(_camera(entry) for entry in content["cameras"])
        poses = tuple(_pose(entry) for entry in content["poses"])
        covariance = content["covariance"]
        stage = content["stage"]
        return RigGeometry(
            names=names,
            reference=_whole(content["reference"]),
            cameras=cameras,
            cam_from_reference=poses,
            covariance=None if covariance is None else _array(covariance, 2),
            stage=None if stage is None else _stage(stage),
        )
    except ConfigError:
        raise
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ConfigError(
            f"a stored calibration is ill-formed ({error})", advice="calibrate again"
        ) from error


def _camera(entry: Mapping[str, Any]) -> CameraModel:
    _require(entry, _CAMERA, "camera")
    lens = _text(entry["lens"])
    if lens not in get_args(LensModel):
        raise ConfigError(
            f"a stored calibration has lens model {lens!r}",
            advice=f"known are {', '.join(get_args(LensModel))}",
        )
    return CameraModel(
        width_px=_whole(entry["width_px"]),
        height_px=_whole(entry["height_px"]),
        fx_px=_number(entry["fx_px"]),
        fy_px=_number(entry["fy_px"]),
        cx_px=_number(entry["cx_px"]),
        cy_px=_number(entry["cy_px"]),
        lens=cast("LensModel", lens),
        coefficients=tuple(map(_number, entry["coefficients"])),
    )


def _pose(entry: Mapping[str, Any]) -> Pose:
    _require(entry, _POSE, "pose")
    return Pose(_array(entry["rotation"], 2), _array(entry["translation_mm"], 1))


def _stage(entry: Mapping[str, Any]) -> StageGeometry:
    _require(entry, _STAGE, "stage")
    axis, covariance = _array(entry["axis"], 1), _array(entry["covariance"], 2)
    if axis.shape != (3,) or covariance.shape != (4, 4):
        raise ConfigError(
            f"a stored stage has an axis of shape {axis.shape} and a covariance of shape "
            f"{covariance.shape}, expected (3,) and (4, 4)",
            advice="calibrate again",
        )
    return StageGeometry(axis, _number(entry["scale"]), _number(entry["zero_mm"]), covariance)


def _require(entry: Mapping[str, Any], names: tuple[str, ...], what: str) -> None:
    if sorted(entry) != sorted(names):
        raise ConfigError(
            f"a stored {what} has the fields {sorted(map(str, entry))}, expected {sorted(names)}",
            advice="it was written by another version: calibrate again",
        )


def _array(value: Any, dimensions: int) -> NDArray[np.float64]:
    array = np.array(value, np.float64)
    if array.ndim != dimensions or not np.isfinite(array).all():
        msg = f"an array of shape {array.shape} has another shape, or numbers that are not finite"
        raise ValueError(msg)
    return array


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        msg = f"{value!r} is not a finite number"
        raise TypeError(msg)
    return float(value)


def _whole(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        msg = f"{value!r} is not a whole number"
        raise TypeError(msg)
    return value


def _text(value: object) -> str:
    if not isinstance(value, str):
        msg = f"{value!r} is not a text"
        raise TypeError(msg)
    return value
