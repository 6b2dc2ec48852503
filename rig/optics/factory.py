"""From what a device says of its cameras to the geometry of the rig."""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError
from rig.factory import FactoryCamera
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile

_FISHEYE_COEFFICIENTS, _BROWN = 4, (5, 8)


def factory_geometry(profile: Profile, cameras: Sequence[FactoryCamera]) -> RigGeometry:
    """Return the geometry of a rig by its device's own calibration; it has no covariance.

    Raises:
        ConfigError: the device knows other views, or a lens that is not known here.
    """
    names = tuple(view.name for view in profile.views)
    by_view = {camera.view: camera for camera in cameras}
    if sorted(by_view) != sorted(names):
        raise ConfigError(
            f"the factory's calibration is of {', '.join(by_view)}, rig {profile.name} has "
            f"{', '.join(names)}",
            advice=f"run `rig calibrate {profile.name}`",
        )
    first_from_view = {
        name: Pose(_turn(camera), np.array(camera.centre_mm)) for name, camera in by_view.items()
    }
    first_from_reference = first_from_view[names[profile.reference]]
    places = [first_from_view[name].inverse() @ first_from_reference for name in names]
    places[profile.reference] = Pose.identity()
    return RigGeometry(
        names, profile.reference, tuple(_model(by_view[name]) for name in names), tuple(places)
    )


def _turn(camera: FactoryCamera) -> Float:
    """The nearest rotation: EEPROMs hold single precision."""
    left, _, right = np.linalg.svd(np.array(camera.rotation, np.float64))
    return left @ right


def _model(camera: FactoryCamera) -> CameraModel:
    (fx, _, cx), (_, fy, cy), _ = camera.matrix_px
    lens, count = _lens(camera)
    return CameraModel(
        camera.width_px, camera.height_px, fx, fy, cx, cy, lens, camera.distortion[:count]
    )


def _lens(camera: FactoryCamera) -> tuple[LensModel, int]:
    if camera.is_fisheye:
        lens, count = "fisheye", _FISHEYE_COEFFICIENTS
    elif any(camera.distortion[_BROWN[0] : _BROWN[1]]):
        lens, count = "brown8", _BROWN[1]
    else:
        lens, count = "brown5", _BROWN[0]
    if len(camera.distortion) < count or any(camera.distortion[count:]):
        raise ConfigError(
            f"the factory's calibration of view {camera.view} has {len(camera.distortion)} lens "
            f"coefficients, {camera.distortion}; {lens} has {count}",
            advice="thin-prism and tilted lenses are not known here: run `rig calibrate`",
        )
    return lens, count
