"""One device whose picture holds several views, over a kernel that is ours."""

import numpy as np
import pytest
from rig_drivers.split import SplitCamera
from rig_drivers.v4l2.camera import V4l2Camera
from rig_drivers.v4l2.device_views import cameras_of
from rig_drivers.v4l2.kind import V4L2
from rig_drivers.v4l2.pixels import to_grey
from rig_sim.clock import VirtualClock

from rig.check.timing import judge_skew
from rig.devices import Camera
from rig.errors import CaptureTimeoutError, DeviceLostError
from rig.profile import V4l2CameraConfig, ViewConfig
from rig.profile.kinds import Surroundings
from tests.support.video_kernel import FakeDevice, FakeVideoKernel

PAIR = {"left": "side-by-side:1", "right": "side-by-side:2"}


def cameras(
    device: FakeDevice, parts: dict[str, str], alone: FakeDevice | None = None
) -> list[Camera]:
    """Return the cameras of a profile whose views are those parts, and one more device."""
    clock = VirtualClock(start_s=100.0)
    devices = dict.fromkeys(parts, "/dev/array")
    if alone is not None:
        devices["alone"] = "/dev/alone"
    kernel = FakeVideoKernel({"/dev/array": device, "/dev/alone": alone or device}, clock)
    name, width_px, height_px = device.modes[0]
    given = {"kind": "v4l2", "devices": devices, "parts": parts, "pixel_format": name}
    size = {"width_px": width_px, "height_px": height_px, "rate_hz": 10, "timeout_s": 1.0}
    return cameras_of(V4l2CameraConfig.model_validate({**given, **size}), kernel, clock)


def painting(picture: np.ndarray, mode: tuple[str, int, int] | None = None) -> FakeDevice:
    height_px, width_px = picture.shape
    mode = mode or ("GREY", width_px, height_px)
    return FakeDevice(modes=(mode,), paint=lambda _: picture.tobytes())


def test_one_frame_becomes_all_views_of_one_instant():
    picture = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64).astype(np.uint8)
    (camera,) = cameras(painting(picture), PAIR)
    assert camera.views == ("left", "right")
    with camera:
        multiview = camera.grab(1.0)
    left, right = multiview.frames
    assert np.array_equal(left.image, picture[:, :32])
    assert np.array_equal(right.image, picture[:, 32:])
    assert left.image.flags.c_contiguous
    assert (left.timestamp_s, left.sequence) == (right.timestamp_s, right.sequence)
    assert multiview.skew_s == 0.0
    assert camera.identity["parts"] == (
        "left 32 x 48 px (x 0..31, y 0..47); right 32 x 48 px (x 32..63, y 0..47)"
    )


def test_parts_of_one_picture_may_differ_in_size():
    picture = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64).astype(np.uint8)
    parts = {"wide": {"width_px": 48}, "narrow": {"x_px": 48, "y_px": 8, "height_px": 32}}
    config = V4l2CameraConfig.model_validate(
        {
            **{"kind": "v4l2", "devices": dict.fromkeys(parts, "/dev/array"), "parts": parts},
            **{"width_px": 64, "height_px": 48, "rate_hz": 10, "pixel_format": "GREY"},
        }
    )
    assert (config.size_of("wide"), config.size_of("narrow")) == ((48, 48), (16, 32))
    clock = VirtualClock(start_s=100.0)
    kernel = FakeVideoKernel({"/dev/array": painting(picture)}, clock)
    (camera,) = cameras_of(config, kernel, clock)
    with camera:
        wide, narrow = camera.grab(1.0).frames
    assert np.array_equal(wide.image, picture[:, :48])
    assert np.array_equal(narrow.image, picture[8:40, 48:])


@pytest.mark.parametrize("layout", ["two-by-two", "four-side-by-side"])
def test_an_array_of_four_sensors_is_four_views(layout: str):
    picture = np.arange(64, dtype=np.uint8)[None, :] + 64 * np.arange(2, dtype=np.uint8)[:, None]
    picture = np.repeat(picture, 24, axis=0)
    (camera,) = cameras(painting(picture), {f"v{n}": f"{layout}:{n}" for n in range(1, 5)})
    with camera:
        first = [int(frame.image[0, 0]) for frame in camera.grab(1.0).frames]
    assert first == ([0, 32, 64, 96] if layout == "two-by-two" else [0, 16, 32, 48])


def test_pixels_that_take_turns_are_put_in_their_places():
    left = np.arange(16 * 24, dtype=np.uint16).reshape(24, 16).astype(np.uint8)
    right = 255 - left
    in_turn = np.stack([left, right], axis=-1).reshape(24, 32)
    (camera,) = cameras(
        painting(in_turn, ("Y8I", 16, 24)), {"left": "interleaved:1", "right": "interleaved:2"}
    )
    with camera:
        frames = camera.grab(1.0).frames
    assert np.array_equal(frames[0].image, left)
    assert np.array_equal(frames[1].image, right)


def test_twelve_bits_of_both_sensors_lie_in_three_bytes():
    data = np.array([0x34, 0xB2, 0xCD, 0xFF, 0x0F, 0x00], np.uint8)
    grey = to_grey(data, "Y12I", width_px=2, height_px=1, bytes_per_line=6)
    assert grey.tolist() == [[0x234, 0xCDB, 0xFFF, 0x000]]


def test_a_device_with_one_view_stays_what_it_is():
    array, alone = (
        cameras(painting(np.zeros((24, 64), np.uint8)), PAIR, None),
        FakeDevice(modes=(("GREY", 64, 24),)),
    )
    assert [type(camera) for camera in array] == [SplitCamera]
    both = cameras(painting(np.zeros((24, 64), np.uint8)), {"left": "whole:1"}, alone)
    assert [type(camera) for camera in both] == [SplitCamera, V4l2Camera]


def test_a_silent_device_names_all_of_its_views():
    (camera,) = cameras(FakeDevice(modes=(("GREY", 64, 24),), is_silent=True), PAIR)
    with camera, pytest.raises(CaptureTimeoutError, match="left, right") as caught:
        camera.grab(0.5)
    assert caught.value.missing == ("left", "right")
    assert caught.value.timeout_s == 0.5


def test_a_closed_one_gives_nothing():
    (camera,) = cameras(FakeDevice(modes=(("GREY", 64, 24),)), PAIR)
    with pytest.raises(DeviceLostError, match="not open"):
        camera.grab(0.5)


def test_the_check_says_that_there_is_no_skew():
    item = judge_skew([0.0, 0.0], 0.005, is_one_picture=True)
    assert item.status == "pass"
    assert item.found == "0 ms: all views come in one picture (2 multi-views)"


def test_the_kind_opens_one_camera_per_device_and_keeps_the_order_of_the_profile():
    names = ("right", "alone", "left")
    config = V4l2CameraConfig.model_validate(
        {
            **{"kind": "v4l2", "width_px": 640, "height_px": 200, "rate_hz": 30},
            **{"pixel_format": "GREY"},
            "devices": {"left": "/dev/array", "right": "/dev/array", "alone": "/dev/alone"},
            "parts": {**PAIR, "alone": {"width_px": 320}},
        }
    )
    views = tuple(ViewConfig(name=n, x_steps=float(i), y_steps=0.0) for i, n in enumerate(names))
    camera = V4L2.open(config, Surroundings("bench", views, VirtualClock()))
    assert camera.views == names
    assert camera.identity["model"] == "2 x v4l2"
    assert camera.identity["left+right.parts"].startswith("left 320 x 200 px (x 0..319")
