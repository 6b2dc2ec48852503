"""Which cameras are there, by the paths that a profile should name."""

from pathlib import Path

from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.inventory import video_nodes
from rig_drivers.v4l2.kind import found_device
from rig_sim.clock import VirtualClock

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


def test_nothing_is_there(tmp_path: Path):
    assert video_nodes(FakeVideoKernel({}, VirtualClock()), root=tmp_path) == []
