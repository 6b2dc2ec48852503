"""From the cameras section of a profile to one camera per device, with all of its views."""

from rig.devices import Camera, Clock
from rig.profile import V4l2CameraConfig
from rig_drivers.split import SplitCamera
from rig_drivers.v4l2.camera import V4l2Camera
from rig_drivers.v4l2.kernel import Kernel


def cameras_of(config: V4l2CameraConfig, kernel: Kernel, clock: Clock) -> list[Camera]:
    """Return the cameras of a profile, closed, each with the views that it gives.

    Args:
        config: modes, controls and parts.
        kernel: the system calls.
        clock: CLOCK_MONOTONIC.
    """
    regions = config.regions
    cameras: list[Camera] = []
    for views in config.by_device.values():
        camera = V4l2Camera(config, views[0], kernel=kernel, clock=clock)
        own = {view: regions[view] for view in views if view in regions}
        cameras.append(SplitCamera(camera, own) if own else camera)
    return cameras
