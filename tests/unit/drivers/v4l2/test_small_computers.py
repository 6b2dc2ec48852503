"""Nodes of small computers: several planes of memory, no sizes, no rates, packed mosaics."""

from errno import ENOLINK, ENOSPC, ENOTTY, EPIPE

import numpy as np
import pytest
from rig_drivers.rate import RateWatch
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.camera import V4l2Camera
from rig_drivers.v4l2.pixels import PixelError, to_grey
from rig_sim.clock import VirtualClock

from rig.errors import ConfigError, DeviceLostError
from rig.profile import V4l2CameraConfig
from tests.support.video_kernel import FakeDevice, FakeVideoKernel

PLANAR = abi.CAP_STREAMING | abi.CAP_VIDEO_CAPTURE_MPLANE
PATH = "/dev/video0"
NO_RATES = {abi.VIDIOC_ENUM_FRAMEINTERVALS: ENOTTY, abi.VIDIOC_G_PARM: ENOTTY}
NO_SIZES = {abi.VIDIOC_ENUM_FRAMESIZES: ENOTTY}


def camera_of(device: FakeDevice, rate_hz: float = 10.0, width_px: int = 64) -> V4l2Camera:
    clock = VirtualClock()
    config = V4l2CameraConfig(
        kind="v4l2",
        devices={"left": PATH},
        width_px=width_px,
        height_px=48,
        rate_hz=rate_hz,
        pixel_format="GREY",
    )
    return V4l2Camera(config, "left", kernel=FakeVideoKernel({PATH: device}, clock), clock=clock)


def test_a_multi_planar_node_gives_its_pictures():
    with camera_of(FakeDevice(capabilities=PLANAR)) as camera:
        frame = camera.grab(2.0).frames[0]
    assert frame.image.shape == (48, 64)
    assert np.all(frame.image == frame.sequence)


def test_a_picture_may_begin_behind_a_head_in_its_plane():
    def paint(_: int) -> bytes:
        return b"\xee" * 5 + bytes([7]) * (70 * 47 + 64)

    device = FakeDevice(capabilities=PLANAR, padding=6, data_offset=5, paint=paint)
    with camera_of(device) as camera:
        frame = camera.grab(2.0).frames[0]
    assert np.all(frame.image == 7)


def test_a_picture_in_several_planes_is_refused_with_their_number():
    camera = camera_of(FakeDevice(capabilities=PLANAR, planes=2))
    with pytest.raises(DeviceLostError, match="GREY 64 x 48 in 2 planes of memory"), camera:
        pass


def test_a_node_without_sizes_takes_the_one_that_it_was_set_to():
    with camera_of(FakeDevice(refused=dict(NO_SIZES))) as camera:
        assert camera.grab(2.0).frames[0].image.shape == (48, 64)


def test_a_node_without_sizes_that_sets_another_is_told_by_what_it_set():
    camera = camera_of(FakeDevice(refused=dict(NO_SIZES)), width_px=80)
    told = r"asked for GREY 80 x 48 at 10 Hz, the nearest it offers is GREY 64 x 48 at 10 Hz"
    with pytest.raises(ConfigError, match=told), camera:
        pass


def test_a_node_without_rates_is_believed_the_rate_of_the_profile():
    with camera_of(FakeDevice(refused=dict(NO_RATES))) as camera:
        sequences = [camera.grab(2.0).frames[0].sequence for _ in range(4)]
        assert camera.identity["mode"] == "GREY 64 x 48"
    assert sequences == sorted(set(sequences))


def test_a_node_that_lists_rates_but_tells_none_is_believed_and_watched():
    """As the receivers of some small computers: a list of rates, and no G_PARM."""
    refused = {abi.VIDIOC_G_PARM: ENOTTY, abi.VIDIOC_S_PARM: ENOTTY}
    with camera_of(FakeDevice(refused=dict(refused))) as camera:
        assert camera.grab(2.0).frames[0].image.shape == (48, 64)
        assert camera.identity["mode"] == "GREY 64 x 48"
    faster = FakeDevice(refused=dict(refused), intervals=((1, 10), (1, 30)))
    told = "asked for 30 Hz, frames come at 10 Hz"
    with camera_of(faster, rate_hz=30.0) as camera, pytest.raises(ConfigError, match=told):
        for _ in range(10):
            camera.grab(2.0)
    camera = camera_of(FakeDevice(refused=dict(refused)), rate_hz=30.0)
    with pytest.raises(ConfigError, match="the nearest it offers is GREY 64 x 48 at 10 Hz"), camera:
        pass


@pytest.mark.parametrize("number", [EPIPE, ENOLINK])
def test_a_sensor_that_is_set_differently_from_its_receiver_is_told(number: int):
    device = FakeDevice(refused={abi.VIDIOC_STREAMON: number})
    with camera_of(device) as camera, pytest.raises(DeviceLostError) as caught:
        camera.grab(2.0)
    assert "media-ctl" in caught.value.advice
    assert "USB" not in caught.value.advice


def test_a_full_bus_is_told_as_before():
    device = FakeDevice(refused={abi.VIDIOC_STREAMON: ENOSPC})
    with camera_of(device) as camera, pytest.raises(DeviceLostError) as caught:
        camera.grab(2.0)
    assert "is the USB bus full?" in caught.value.advice


def test_a_node_without_rates_that_runs_at_another_is_told_with_both():
    device = FakeDevice(refused=dict(NO_RATES))
    told = "asked for 30 Hz, frames come at 10 Hz, and the device takes no rate"
    with camera_of(device, rate_hz=30.0) as camera, pytest.raises(ConfigError, match=told):
        for _ in range(10):
            camera.grab(2.0)


@pytest.mark.parametrize(("found_hz", "is_right"), [(10.9, True), (11.2, False), (8.9, False)])
def test_a_rate_may_be_a_tenth_off(found_hz: float, is_right: bool):
    watch = RateWatch("camera", 10.0, advice="set it")
    for sequence in (0, 1, 3, 4):
        watch.see(sequence, 5.0 + sequence / found_hz)
    if is_right:
        watch.see(5, 5.0 + 5 / found_hz)
        watch.see(6, 100.0)  # looked at no more
    else:
        with pytest.raises(ConfigError):
            watch.see(5, 5.0 + 5 / found_hz)
    assert found_hz > 0.0


def test_uyvy_gives_its_luma():
    data = np.array([[90, 1, 91, 2, 90, 3, 91, 4]], np.uint8).ravel()
    image = to_grey(data, "UYVY", width_px=4, height_px=1, bytes_per_line=8)
    assert image.tolist() == [[1, 2, 3, 4]]


def test_ten_bits_are_unpacked_four_from_five_bytes():
    row = [0x80, 0xFF, 0x00, 0x01, 0b11_10_01_00, 0xAA]
    data = np.array(row * 2, np.uint8)
    image = to_grey(data, "Y10P", width_px=4, height_px=2, bytes_per_line=6)
    assert image.dtype == np.uint16
    assert image.tolist() == [[0x200, 0x3FD, 0x002, 0x007]] * 2


def test_twelve_bits_are_unpacked_two_from_three_bytes():
    data = np.array([0x80, 0xFF, 0xA5, 0x01, 0x02, 0x43], np.uint8)
    image = to_grey(data, "Y12P", width_px=3, height_px=1, bytes_per_line=6)
    assert image.tolist() == [[0x805, 0xFFA, 0x013]]


@pytest.mark.parametrize("name", ["Y10P", "Y12P", "pRAA", "pRCC", "UYVY", "RGGB", "RG10"])
def test_a_short_buffer_is_no_picture(name: str):
    with pytest.raises(PixelError, match="needed for 6 lines"):
        to_grey(np.zeros(10, np.uint8), name, width_px=8, height_px=6, bytes_per_line=16)


@pytest.mark.parametrize(
    ("name", "colours"),
    [("RGGB", "RGGB"), ("BA81", "BGGR"), ("GBRG", "GBRG"), ("GRBG", "GRBG")],
)
def test_a_mosaic_of_one_colour_is_grey_by_its_weights(name: str, colours: str):
    level = {"R": 200, "G": 100, "B": 40}
    tile = np.array([level[colour] for colour in colours], np.uint8).reshape(2, 2)
    data = np.tile(tile, (3, 4)).ravel()
    image = to_grey(data, name, width_px=8, height_px=6, bytes_per_line=8)
    assert np.all(image == (200 + 2 * 100 + 40) // 4)


def test_a_mosaic_keeps_the_counts_of_the_sensor_and_shifts_nothing():
    mosaic = np.zeros((5, 6), "<u2")
    mosaic[2, 3] = 1023
    image = to_grey(
        mosaic.view(np.uint8).ravel(), "BG10", width_px=6, height_px=5, bytes_per_line=12
    )
    weights = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]])
    assert image.dtype == np.uint16
    assert np.array_equal(image[1:4, 2:5], (1023 * weights + 8) // 16)
    assert image[0].max() == image[:, 0].max() == 0


def test_a_single_line_is_no_mosaic():
    with pytest.raises(PixelError, match="8 x 1 px are no mosaic"):
        to_grey(np.zeros(8, np.uint8), "RGGB", width_px=8, height_px=1, bytes_per_line=8)
