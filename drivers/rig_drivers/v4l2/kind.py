"""V4L2 cameras, one per view, as a kind of camera."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from rig.devices import Camera, SystemClock
from rig.discovery import FoundDevice, FoundPicture, Search
from rig.profile import V4l2CameraConfig
from rig.profile.kinds import CameraKind, CameraTemplate, NewCamera, Surroundings
from rig.profile.parts import likely_layout, picture_of, places_of

if TYPE_CHECKING:
    from rig_drivers.v4l2.inventory import VideoNode

_SECTION = """\
[camera]
kind = "v4l2"
width_px = {width_px}{whole}
height_px = {height_px}
rate_hz = {rate_hz:g}
pixel_format = "{pixel_format}"  # {formats}
exposure_s = 0.008     # locked; the white squares should reach 70 % of full scale
# gain = 16            # lock it too: the number that v4l2-ctl shows
# focus = 0            # only for lenses with autofocus: lock it
max_skew_s = 0.005     # a board that stands still allows more

# By view name. A path in /dev/v4l/by-path names the USB socket and stays; /dev/videoN does not.
[camera.devices]
{devices}
"""
_OTHER_FORMATS = "or Y10, Y10P, YUYV, RGGB ...; MJPG is the last resort"
_PARTS = """\
# Which part of the device's picture each view is. MEASURE: cover one lens after the other.
[camera.parts]"""


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

    return [found_device(node) for node in video_nodes(LinuxKernel())]


def found_device(node: "VideoNode") -> FoundDevice:
    """Return what `rig devices` says of a node, and a profile calls it."""
    layout = likely_layout(node.largest_px, node.pixel_formats)
    formats = ", ".join(node.pixel_formats) or "formats unknown"
    size = "" if node.largest_px is None else "; up to {} x {} px".format(*node.largest_px)
    guess = "" if layout is None else f", perhaps {places_of(layout)} views, {layout}"
    return FoundDevice(
        str(node.best_path),
        f"{node.card or 'camera'}; {formats}{size}{guess}",
        tuple(str(path) for path in (*node.stable_paths[1:], node.path)),
        node.trouble,
        layout,
        _picture(node),
    )


def _picture(node: "VideoNode") -> FoundPicture | None:
    best = node.best
    if best is None or best.rate_hz is None:
        return None
    return FoundPicture(best.pixel_format, best.width_px, best.height_px, best.rate_hz)


def _section(new: NewCamera) -> str:
    layout, best = new.layout, new.picture
    width_px, height_px = new.width_px, new.height_px
    pixel_format, rate_hz, formats = "GREY", 30.0, _OTHER_FORMATS
    if layout is None:
        if best is not None:
            width_px, height_px, rate_hz = best.width_px, best.height_px, best.rate_hz
            pixel_format, formats = best.pixel_format, f"as the first device offers it; {formats}"
        lines = [
            f"{view} = {json.dumps(_path_of(view, place, new.devices))}"
            for place, view in enumerate(new.views)
        ]
        lines += [f"# also plugged in: {path}" for path in new.devices[len(new.views) :]]
    else:
        lines = [f"{view} = {json.dumps(_path_of('all', 0, new.devices))}" for view in new.views]
        lines += [f"# also plugged in: {path}" for path in new.devices[1:]]
        lines += ["", _PARTS]
        lines += [f'{view} = "{layout}:{place}"' for place, view in enumerate(new.views, start=1)]
        if layout != "interleaved":  # whose formats count the pixels of one view
            width_px, height_px = picture_of(layout, (width_px, height_px))
        else:
            pixel_format = "Y8I"
    return _SECTION.format(
        width_px=width_px,
        height_px=height_px,
        rate_hz=rate_hz,
        pixel_format=pixel_format,
        formats=formats,
        whole="" if layout is None else "  # of the whole picture. MEASURE: what the device offers",
        devices="\n".join(lines),
    )


def _path_of(view: str, place: int, plugged: tuple[str, ...]) -> str:
    return plugged[place] if place < len(plugged) else f"/dev/v4l/by-path/REPLACE-BY-YOURS-{view}"


V4L2 = CameraKind(
    contract=1,
    name="v4l2",
    config=V4l2CameraConfig,
    open=_open,
    search=Search("v4l2", "camera.devices", _find, "V4L2 cameras"),
    template=CameraTemplate("V4L2 cameras", _section, takes_layout=True),
)
