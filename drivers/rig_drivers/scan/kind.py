"""A camera that moves, as a kind of camera."""

from rig.devices import Camera
from rig.profile import ScanCameraConfig
from rig.profile.kinds import CameraKind, Surroundings


def _open(config: ScanCameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.scan.camera import ScanCamera

    if around.inner is None:
        raise AssertionError  # whoever opens a scan opens what it carries
    return ScanCamera(config, around, around.inner)


SCAN = CameraKind(contract=1, name="scan", config=ScanCameraConfig, open=_open)
