"""Which cameras are there, by the paths that a profile should name."""

import tomllib
from errno import ENOTTY
from pathlib import Path

import pytest
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.best_mode import best_mode
from rig_drivers.v4l2.formats import Mode, size_offers
from rig_drivers.v4l2.inventory import video_nodes
from rig_drivers.v4l2.kind import found_device
from rig_drivers.v4l2.node import Node
from rig_sim.clock import VirtualClock

from rig.discovery import Findings
from rig.profile import V4l2CameraConfig
from rig.profile.load import parse_profile
from rig.profile.plugged import recipe_for
from rig.profile.template import profile_text
from tests.support.video_kernel import FakeControl, FakeDevice, FakeVideoKernel


def test_cameras_are_listed_with_stable_paths_and_trouble(tmp_path: Path):
    gain = FakeControl(abi.CID_GAIN, "Gain", 0, 255, 64)
    devices = {
        "video0": FakeDevice(card="Left", controls=[gain]),
        "video1": FakeDevice(capabilities=abi.CAP_STREAMING),  # its metadata
        "video2": FakeDevice(
            card="Right", modes=(("MJPG", 64, 48), ("MJPG", 128, 48), ("YUYV", 64, 48))
        ),
        "video10": FakeDevice(refused={abi.VIDIOC_QUERYCAP: 13}),
    }
    for name in devices:
        (tmp_path / name).touch()
    for folder, link, name in (
        ("by-id", "usb-left-video-index0", "video0"),
        ("by-path", "pci-1-video-index0", "video0"),
        ("by-path", "pci-1-video-index1", "video1"),
    ):
        (tmp_path / "v4l" / folder).mkdir(parents=True, exist_ok=True)
        (tmp_path / "v4l" / folder / link).symlink_to(tmp_path / name)
    kernel = FakeVideoKernel(
        {str(tmp_path / name): device for name, device in devices.items()}, VirtualClock()
    )
    left, right, closed = video_nodes(kernel, root=tmp_path)
    assert left.card == "Left"
    assert left.best_path == tmp_path / "v4l" / "by-path" / "pci-1-video-index0"
    assert left.stable_paths[1].name == "usb-left-video-index0"
    assert left.controls == ("gain",)
    assert right.best_path == tmp_path / "video2"
    assert right.pixel_formats == ("MJPG", "YUYV")
    assert right.largest_px == (128, 48)
    assert left.largest_px == (64, 48)
    assert found_device(right).layout == "side-by-side"
    assert found_device(right).description == (
        "Right; MJPG, YUYV; up to 128 x 48 px, perhaps 2 views, side-by-side"
    )
    assert found_device(left).layout is None
    assert found_device(left).description == "Left; GREY; up to 64 x 48 px"
    assert closed.path == tmp_path / "video10"
    assert closed.trouble is not None
    assert "usermod -aG video" in closed.trouble
    assert kernel.open_descriptors == set()


def best_of(**what: object) -> Mode | None:
    device = FakeDevice(**what)  # pyright: ignore[reportArgumentType]
    kernel = FakeVideoKernel({"/dev/video0": device}, VirtualClock())
    with Node(Path("/dev/video0"), kernel) as node:
        return best_mode(node, size_offers(node))


@pytest.mark.parametrize(
    ("modes", "best"),
    [
        ((("MJPG", 1280, 720), ("YUYV", 640, 480)), Mode("YUYV", 640, 480, 30.0)),
        ((("YUYV", 640, 480), ("GREY", 320, 240)), Mode("GREY", 320, 240, 30.0)),
        ((("YUYV", 320, 240), ("YUYV", 1280, 720)), Mode("YUYV", 1280, 720, 30.0)),
        ((("YUYV", 1920, 1080), ("MJPG", 1280, 720)), Mode("MJPG", 1280, 720, 30.0)),
        ((("RG10", 1280, 800), ("Y8I", 640, 400)), Mode("RG10", 1280, 800, 30.0)),
        ((("YUYV", 1920, 1080),), None),
        ((("H264", 640, 480),), None),
    ],
)
def test_a_new_profile_begins_with_what_measures_best(
    modes: tuple[tuple[str, int, int], ...], best: Mode | None
):
    assert best_of(modes=modes, intervals=((1, 5), (1, 30), (1, 60))) == best


def test_a_rate_too_slow_to_look_through_is_none():
    assert best_of(intervals=((1, 5),)) is None
    assert best_of(intervals=((1, 120),)) == Mode("GREY", 64, 48, 120.0)
    assert best_of(refused={abi.VIDIOC_ENUM_FRAMEINTERVALS: ENOTTY}) is None
    assert best_of(refused={abi.VIDIOC_ENUM_FRAMESIZES: ENOTTY}) is None


def test_a_new_profile_of_webcams_asks_for_what_they_offer(tmp_path: Path):
    paths = [tmp_path / f"video{number}" for number in range(2)]
    devices: dict[str, FakeDevice] = {}
    for path in paths:
        path.touch()
        modes = (("MJPG", 1280, 720), ("YUYV", 640, 480))
        devices[str(path)] = FakeDevice(modes=modes, intervals=((1, 15),))
    nodes = video_nodes(FakeVideoKernel(devices, VirtualClock()), root=tmp_path)
    findings = [Findings("v4l2", "camera.devices", tuple(found_device(node) for node in nodes))]
    recipe = recipe_for("b", findings, camera=None, views=None, stage=None)
    camera = parse_profile(tomllib.loads(profile_text(recipe)), source="new").camera
    assert isinstance(camera, V4l2CameraConfig)
    assert (camera.pixel_format, camera.width_px, camera.height_px) == ("YUYV", 640, 480)
    assert camera.rate_hz == 15.0


def test_nothing_is_there(tmp_path: Path):
    assert video_nodes(FakeVideoKernel({}, VirtualClock()), root=tmp_path) == []
