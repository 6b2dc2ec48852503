"""One V4L2 camera over a kernel that misbehaves."""

import itertools
from collections import deque

import numpy as np
import pytest
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.camera import V4l2Camera
from rig_sim.clock import VirtualClock

from rig.errors import CaptureTimeoutError, ConfigError, DeviceLostError, DeviceNotFoundError
from rig.profile import V4l2CameraConfig
from tests.support.video_kernel import FakeControl, FakeDevice, FakeVideoKernel

PATH = "/dev/v4l/by-path/left"
EIO, EINVAL, EACCES, EBUSY, ENOSPC = 5, 22, 13, 16, 28


class Bench:
    """A camera, its device and their time."""

    def __init__(self, device: FakeDevice | None = None, **values: object) -> None:
        self.device = device or FakeDevice()
        self.clock = VirtualClock(start_s=100.0)
        self.kernel = FakeVideoKernel({PATH: self.device}, self.clock)
        name, width, height = self.device.modes[0]
        plain = {"kind": "v4l2", "devices": {"left": PATH}, "width_px": width, "rate_hz": 10}
        given = {**plain, "height_px": height, "pixel_format": name, "timeout_s": 1.0, **values}
        config = V4l2CameraConfig.model_validate(given)
        self.camera = V4l2Camera(config, "left", kernel=self.kernel, clock=self.clock)

    def numbers(self, count: int) -> list[int]:
        """Return the numbers that the device painted into the next frames of a stream."""
        taken = itertools.islice(self.camera.stream(), count)
        return [int(multiview.frames[0].image[0, 0]) for multiview in taken]


def test_frames_come_in_order_with_their_numbers_and_times():
    bench = Bench(FakeDevice(padding=16))
    with bench.camera as camera:
        taken = [multiview.frames[0] for multiview in itertools.islice(camera.stream(), 6)]
    assert [frame.sequence for frame in taken] == [0, 1, 2, 3, 4, 5]
    assert [int(frame.image[0, 0]) for frame in taken] == [0, 1, 2, 3, 4, 5]
    assert [frame.timestamp_s for frame in taken] == pytest.approx(
        [100.1, 100.2, 100.3, 100.4, 100.5, 100.6], abs=1e-5
    )
    assert taken[0].image.shape == (48, 64)
    assert taken[0].bits == 8
    assert bench.kernel.open_descriptors == set()
    assert sum(camera.dropped.values()) == 0


def test_a_frame_has_its_own_pixels():
    bench = Bench()
    with bench.camera as camera:
        first = camera.grab(1.0).frames[0]
        before = first.image.copy()
        for _ in range(6):
            camera.grab(1.0)
    assert np.array_equal(first.image, before)


def test_a_grab_waits_for_a_frame_whose_exposure_surely_began_after_the_call():
    bench = Bench()
    with bench.camera as camera:
        camera.start()
        bench.clock.sleep_s(0.35)  # three old frames wait, one is being exposed
        called_s = bench.clock.now_s()
        frame = camera.grab(1.0).frames[0]
    # Neither exposure nor transfer are known: both may take a whole interval.
    assert frame.timestamp_s - 0.2 >= called_s
    assert frame.sequence == 5
    assert sum(camera.dropped.values()) == 0


def exposing(value: int) -> list[FakeControl]:
    return [FakeControl(abi.CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 1, 5000, value)]


def test_with_a_known_exposure_the_time_is_its_middle():
    bench = Bench(FakeDevice(controls=exposing(7)), exposure_s=0.008)
    with bench.camera as camera:
        frame = next(camera.stream()).frames[0]
        assert frame.exposure_s == pytest.approx(0.008)
        assert frame.timestamp_s == pytest.approx(100.1 - 0.004, abs=1e-5)
        assert frame.began_s == pytest.approx(100.1 - 0.008 - 0.1, abs=1e-5)
        assert "exposure_time_absolute=80" in camera.identity["controls"]


def test_a_driver_that_stamps_the_start_of_exposure_leaves_no_doubt():
    flags = abi.BUF_FLAG_TIMESTAMP_MONOTONIC | abi.BUF_FLAG_TIMESTAMP_START_OF_EXPOSURE
    bench = Bench(FakeDevice(controls=exposing(80), timestamp_flags=flags))
    with bench.camera as camera:
        frame = next(camera.stream()).frames[0]
    assert frame.timestamp_s == pytest.approx(100.1 + 0.004, abs=1e-5)
    assert frame.began_s == pytest.approx(100.1, abs=1e-5)


@pytest.mark.parametrize(
    ("fault", "reason", "numbers"),
    [
        (FakeDevice(damaged={1, 2}), "damaged", [0, 3, 4]),
        (FakeDevice(lost={1, 2}), "lost", [0, 3, 4]),
        (FakeDevice(shift_s={1: -0.1, 2: -0.2}), "duplicate", [0, 3, 4]),
        (FakeDevice(shift_s={1: 5e8, 2: -5e8}), "timestamp", [0, 3, 4]),
    ],
)
def test_what_is_of_no_use_is_dropped_and_counted(
    fault: FakeDevice, reason: str, numbers: list[int]
):
    bench = Bench(fault)
    with bench.camera as camera:
        assert bench.numbers(3) == numbers
        assert camera.dropped[reason] >= 1
        assert sum(camera.dropped.values()) == 2


def test_a_damaged_jpeg_is_dropped_and_counted():
    bench = Bench(FakeDevice(modes=(("MJPG", 64, 48),), paint=lambda _: b"\xff\xd8 no picture"))
    with bench.camera as camera:
        with pytest.raises(CaptureTimeoutError):
            camera.grab(0.55)
        assert camera.dropped["damaged"] >= 4
        with pytest.raises(CaptureTimeoutError):
            next(camera.stream())


def test_a_counter_that_wraps_around_goes_on():
    bench = Bench(FakeDevice(first_counter=(1 << 32) - 2, lost={3}))
    with bench.camera as camera:
        taken = [multiview.frames[0] for multiview in itertools.islice(camera.stream(), 4)]
        assert [frame.sequence for frame in taken] == [0, 1, 2, 4]
        assert camera.dropped["lost"] == 1


def test_times_of_another_clock_are_not_taken_as_ours():
    bench = Bench(FakeDevice(timestamp_flags=0))
    with bench.camera as camera, pytest.raises(CaptureTimeoutError, match=r"usable \(\d+ timestam"):
        camera.grab(1.0)


def test_silence_ends_in_a_timeout_that_names_the_view():
    bench = Bench(FakeDevice(is_silent=True))
    with bench.camera as camera:
        with pytest.raises(CaptureTimeoutError, match="nothing came from left") as caught:
            camera.grab(0.5)
        assert caught.value.missing == ("left",)
        assert bench.clock.now_s() == pytest.approx(100.5)


@pytest.mark.parametrize("request_number", [abi.VIDIOC_DQBUF, abi.VIDIOC_QBUF])
def test_a_streaming_error_is_overcome_and_counted(request_number: int):
    bench = Bench()
    with bench.camera as camera:
        before = camera.grab(1.0).frames[0]
        bench.device.failing[request_number] = deque([EIO])
        after = camera.grab(1.0).frames[0]
        later = next(camera.stream()).frames[0]
        assert camera.dropped["restart"] == 1
    assert before.sequence < after.sequence < later.sequence
    assert before.timestamp_s < after.timestamp_s < later.timestamp_s


def test_a_stream_that_fails_again_and_again_is_given_up():
    bench = Bench()
    with bench.camera as camera:
        bench.device.failing[abi.VIDIOC_DQBUF] = deque([EIO] * 50)
        with pytest.raises(DeviceLostError, match="streaming failed 4 times in a row"):
            camera.grab(1.0)


def test_a_stream_that_cannot_be_restarted_says_both_errors():
    bench = Bench()
    with bench.camera as camera:
        camera.start()
        bench.device.failing[abi.VIDIOC_DQBUF] = deque([EIO])
        bench.device.failing[abi.VIDIOC_STREAMON] = deque([EINVAL])
        with pytest.raises(DeviceLostError, match="cannot be restarted"):
            camera.grab(1.0)


@pytest.mark.parametrize(
    "request_number", [abi.VIDIOC_REQBUFS, abi.VIDIOC_QBUF, abi.VIDIOC_STREAMON]
)
def test_a_stream_that_does_not_start_leaves_nothing_open(request_number: int):
    bench = Bench()
    bench.device.failing[request_number] = deque([ENOSPC])
    with pytest.raises(DeviceLostError, match="does not start to stream"), bench.camera as camera:
        camera.start()
    assert bench.kernel.open_descriptors == set()
    with bench.camera as camera:
        assert camera.grab(1.0).frames[0].view == "left"


def test_unplugged_and_plugged_in_again():
    bench = Bench()
    with bench.camera as camera:
        camera.grab(1.0)
        bench.device.is_plugged = False
        with pytest.raises(DeviceLostError, match="was unplugged"):
            camera.grab(1.0)
    with pytest.raises(DeviceNotFoundError, match="is not there; plug it in"), bench.camera:
        pass
    bench.device.is_plugged = True
    with bench.camera as camera:
        assert camera.grab(1.0).frames[0].sequence < 10
    assert bench.kernel.open_descriptors == set()


@pytest.mark.parametrize(
    ("number", "message"), [(EACCES, "usermod -aG video"), (EBUSY, "used by another program")]
)
def test_a_camera_that_may_not_be_opened_says_what_to_do(number: int, message: str):
    bench = Bench(FakeDevice(refused={abi.VIDIOC_QUERYCAP: number}))
    with pytest.raises(DeviceNotFoundError, match=message), bench.camera:
        pass


@pytest.mark.parametrize(
    ("capabilities", "message"),
    [
        (abi.CAP_STREAMING, "does not stream pictures on this node"),
        (abi.CAP_VIDEO_CAPTURE_MPLANE, "does not stream pictures on this node"),
    ],
)
def test_a_node_that_gives_no_pictures_is_no_camera(capabilities: int, message: str):
    bench = Bench(FakeDevice(capabilities=capabilities))
    with pytest.raises(DeviceNotFoundError, match=message), bench.camera:
        pass
    assert bench.kernel.open_descriptors == set()


def test_a_refused_control_leaves_nothing_open():
    bench = Bench(gain=3)
    with pytest.raises(ConfigError, match=r"camera\.gain, has no control"), bench.camera:
        pass
    assert bench.kernel.open_descriptors == set()


def test_a_slow_reader_of_a_stream_gets_fresh_frames():
    bench = Bench()
    with bench.camera as camera:
        stream = camera.stream()
        next(stream)
        bench.clock.sleep_s(1.0)
        frame = next(stream).frames[0]
        assert bench.clock.now_s() - frame.timestamp_s <= 0.11
        assert frame.sequence == 11
        assert camera.dropped == {"late": 4, "lost": 6}


def test_a_reader_that_is_always_slow_still_gets_frames():
    bench = Bench()
    with bench.camera as camera:
        stream = camera.stream()
        for _ in range(5):
            bench.clock.sleep_s(0.9)
            frame = next(stream).frames[0]
            assert bench.clock.now_s() - frame.timestamp_s <= 0.11


def test_a_stream_that_is_always_late_passes_over_as_many_frames_as_there_are_buffers():
    bench = Bench(FakeDevice(shift_s=dict.fromkeys(range(40), -0.5)))
    bench.clock.sleep_s(1.0)
    with bench.camera as camera:
        stream = camera.stream()
        bench.clock.sleep_s(1.0)
        taken = [next(stream).frames[0].sequence for _ in range(2)]
        assert camera.dropped["late"] == 8
    assert taken[1] - taken[0] == 5
