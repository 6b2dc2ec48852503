"""The lenslet camera as a kind of camera: around a camera of any other kind."""

from dataclasses import replace

from rig.devices import Camera
from rig.profile import RAW_VIEW, LensletCameraConfig
from rig.profile.kinds import CameraKind, Surroundings
from rig.profile.plugins import CAMERAS


def _open(config: LensletCameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.lenslet.camera import LensletCamera

    inside = CAMERAS.kind(config.raw.kind).open(config.raw, replace(around, views=(RAW_VIEW,)))
    return LensletCamera(config, around, inside)


LENSLET = CameraKind(contract=1, name="lenslet", config=LensletCameraConfig, open=_open)
