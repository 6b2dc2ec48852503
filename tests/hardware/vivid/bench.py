"""The guest's virtual cameras, as a rig of them, and what can be done to them."""

import ctypes
import subprocess
from pathlib import Path

from rig_drivers.array.camera_array import CameraArray
from rig_drivers.v4l2.camera import V4l2Camera
from rig_drivers.v4l2.controls import Controls, ControlValue
from rig_drivers.v4l2.kernel import LinuxKernel
from rig_drivers.v4l2.node import Node

from rig.devices import SystemClock
from rig.profile import V4l2CameraConfig

_DRIVER = Path("/sys/bus/platform/drivers/vivid")
_LINKS = Path("/dev/v4l/by-path")
_WEBCAM, _HDMI = 0, 1
_S_INPUT = 0xC0045627


def capture_path(number: int) -> Path:
    """Return the stable path of a camera, made as udev would make it."""
    return _link(number, "vid-cap")


def output_path(number: int) -> Path:
    """Return the stable path of the node that feeds a camera's HDMI input."""
    return _link(number, "vid-out")


def v4l2_ctl(path: Path, *arguments: str) -> str:
    """Run the independent tool on a node and return what it prints."""
    done = subprocess.run(
        ["v4l2-ctl", "-d", str(path), *arguments], capture_output=True, text=True, check=True
    )
    return done.stdout


def set_control(number: int, name: str, value: ControlValue) -> None:
    """Set a control of a camera's capture node, without reading it back."""
    set_controls(capture_path(number), {name: value})


def set_controls(path: Path, values: dict[str, ControlValue]) -> None:
    """Set controls of any node by name."""
    with _opened(path) as node:
        Controls(node).apply(values)


def use_webcam(number: int) -> None:
    """Let a camera show its own test picture."""
    with _opened(capture_path(number)) as node:
        node.ioctl(_S_INPUT, ctypes.c_int(_WEBCAM))


def use_loop(number: int, timings: str) -> None:
    """Let a camera show what is written to its output node.

    Args:
        number: of the camera.
        timings: of the HDMI line, as `v4l2-ctl --set-dv-bt-timings` takes them.
    """
    v4l2_ctl(capture_path(number), f"--set-input={_HDMI}")
    v4l2_ctl(capture_path(number), f"--set-dv-bt-timings={timings}")
    v4l2_ctl(output_path(number), f"--set-dv-bt-timings={timings}")
    set_controls(capture_path(number), {"loop_video": True, "osd_text_mode": "None"})


def unplug_all() -> None:
    """Take all cameras away; programs that hold one open keep only an empty shell."""
    (_DRIVER / "unbind").write_text("vivid.0")


def plug_all() -> None:
    """Bring all cameras back, in their first state."""
    for link in _LINKS.glob("vivid-*"):
        link.unlink()
    (_DRIVER / "bind").write_text("vivid.0")


def camera_config(views: dict[str, int], **values: object) -> V4l2CameraConfig:
    """Return the configuration of the named cameras, 320 x 180 grey at 10 Hz unless told."""
    plain = {"kind": "v4l2", "width_px": 320, "height_px": 180, "rate_hz": 10, "timeout_s": 10.0}
    devices = {view: str(capture_path(number)) for view, number in views.items()}
    given = {**plain, "pixel_format": "GREY", "max_skew_s": 0.025, "devices": devices, **values}
    return V4l2CameraConfig.model_validate(given)


def one_camera(number: int = 0, **values: object) -> V4l2Camera:
    """Return one camera under the name `left`."""
    config = camera_config({"left": number}, **values)
    return V4l2Camera(config, "left", kernel=LinuxKernel(), clock=SystemClock())


def camera_array(views: tuple[str, ...], **values: object) -> CameraArray:
    """Return the first cameras as one, one per name.

    At 5 Hz: the phases of cameras that two emulated cores start are some 10 ms apart, more on a
    busy machine.
    """
    slow = {"rate_hz": 5, "max_skew_s": 0.2, "controls": {"timestamp_source": 1}, **values}
    config = camera_config({view: number for number, view in enumerate(views)}, **slow)
    kernel, clock = LinuxKernel(), SystemClock()
    return CameraArray(
        [V4l2Camera(config, view, kernel=kernel, clock=clock) for view in views],
        views=views,
        period_s=1.0 / config.rate_hz,
        max_skew_s=config.max_skew_s,
        timeout_s=config.timeout_s,
    )


def _opened(path: Path) -> Node:
    return Node(path, LinuxKernel())


def _link(number: int, role: str) -> Path:
    name = f"vivid-{number:03d}-{role}"
    link = _LINKS / name
    if not link.exists():
        _LINKS.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        for told in Path("/sys/class/video4linux").glob("*/name"):
            if told.read_text().strip() == name:
                link.symlink_to(f"/dev/{told.parent.name}")
    return link
