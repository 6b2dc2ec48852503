"""Arrays of V4L2 cameras over a kernel that is ours, in real time."""

from collections.abc import Callable, Sequence
from typing import Final

from rig_drivers.array.camera_array import CameraArray
from rig_drivers.v4l2.camera import V4l2Camera

from rig.devices import Clock, SystemClock
from rig.profile import V4l2CameraConfig
from tests.support.video_kernel import FakeDevice, FakeVideoKernel

VIDEO_PERIOD_S: Final = 1.0 / 25.0


def locked(_: int) -> FakeDevice:
    """Return a camera that exposes together with all others of its kind."""
    return FakeDevice(modes=(("GREY", 32, 24),), intervals=((1, 25),), is_locked=True)


def video_array(
    views: Sequence[str],
    device: Callable[[int], FakeDevice] = locked,
    *,
    max_skew_s: float = 0.005,
    timeout_s: float = 2.0,
) -> tuple[CameraArray, list[FakeDevice], Clock]:
    """Return an array of cameras at 25 Hz, their devices to do harm to, and their clock."""
    clock = SystemClock()
    devices = [device(number) for number in range(len(views))]
    paths = {view: f"/dev/v4l/by-path/{view}" for view in views}
    kernel = FakeVideoKernel(dict(zip(paths.values(), devices, strict=True)), clock)
    config = V4l2CameraConfig(
        kind="v4l2",
        devices=paths,
        width_px=32,
        height_px=24,
        rate_hz=25.0,
        pixel_format="GREY",
        timeout_s=timeout_s,
        max_skew_s=max_skew_s,
    )
    cameras = [V4l2Camera(config, view, kernel=kernel, clock=clock) for view in views]
    array = CameraArray(
        cameras,
        views=views,
        period_s=VIDEO_PERIOD_S,
        max_skew_s=max_skew_s,
        timeout_s=timeout_s,
    )
    return array, devices, clock
