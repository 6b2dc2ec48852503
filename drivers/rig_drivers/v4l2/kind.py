"""V4L2 cameras, one per view, as a kind of camera."""

import json
from pathlib import Path

from rig.devices import Camera, SystemClock
from rig.discovery import FoundDevice, Search
from rig.profile import V4l2CameraConfig
from rig.profile.kinds import CameraKind, CameraTemplate, NewCamera, Surroundings

_SECTION = """\
[camera]
kind = "v4l2"
width_px = {width_px}
height_px = {height_px}
rate_hz = 30
pixel_format = "GREY"  # or Y10, Y10P, YUYV, RGGB ...; MJPG is the last resort
exposure_s = 0.008     # locked; the white squares should reach 70 % of full scale
# gain = 16            # lock it too: the number that v4l2-ctl shows
# focus = 0            # only for lenses with autofocus: lock it
max_skew_s = 0.005     # a board that stands still allows more

# By view name. A path in /dev/v4l/by-path names the USB socket and stays; /dev/videoN does not.
[camera.devices]
{devices}
"""


def _open(config: V4l2CameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.array.camera_array import CameraArray
    from rig_drivers.v4l2.device_views import cameras_of
    from rig_drivers.v4l2.kernel import LinuxKernel

    return CameraArray(
        cameras_of(config, LinuxKernel(), SystemClock()),
        views=[view.name for view in around.views],
        period_s=1.0 / config.rate_hz,
        max_skew_s=config.max_skew_s,
        timeout_s=config.timeout_s,
    )


def _find(_timeout_s: float) -> list[FoundDevice]:
    if not any(Path("/dev").glob("video[0-9]*")):
        return []  # what it takes to ask them is imported for them only
    from rig_drivers.v4l2.inventory import video_nodes
    from rig_drivers.v4l2.kernel import LinuxKernel

    return [
        FoundDevice(
            str(node.best_path),
            f"{node.card or 'camera'}; {', '.join(node.pixel_formats) or 'formats unknown'}",
            tuple(str(path) for path in (*node.stable_paths[1:], node.path)),
            node.trouble,
        )
        for node in video_nodes(LinuxKernel())
    ]


def _section(new: NewCamera) -> str:
    lines = [
        f"{view} = {json.dumps(_path_of(view, place, new.devices))}"
        for place, view in enumerate(new.views)
    ]
    lines += [f"# also plugged in: {path}" for path in new.devices[len(new.views) :]]
    return _SECTION.format(width_px=new.width_px, height_px=new.height_px, devices="\n".join(lines))


def _path_of(view: str, place: int, plugged: tuple[str, ...]) -> str:
    return plugged[place] if place < len(plugged) else f"/dev/v4l/by-path/REPLACE-BY-YOURS-{view}"


V4L2 = CameraKind(
    contract=1,
    name="v4l2",
    config=V4l2CameraConfig,
    open=_open,
    search=Search("v4l2", "camera.devices", _find, "V4L2 cameras"),
    template=CameraTemplate("V4L2 cameras", _section),
)
