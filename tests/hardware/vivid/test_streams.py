"""Streams of four virtual cameras, and everything that `vivid` can do to them."""

import itertools

import numpy as np
import pytest
from rig_drivers.array.camera_array import CameraArray

from rig.errors import CaptureTimeoutError, DeviceLostError, DeviceNotFoundError
from tests.hardware.vivid.bench import (
    camera_array,
    one_camera,
    plug_all,
    set_control,
    unplug_all,
    use_webcam,
)

pytestmark = pytest.mark.slow

VIEWS = ("left", "right", "top", "bottom")


@pytest.fixture(autouse=True)
def webcams() -> None:
    for number in range(len(VIEWS)):
        use_webcam(number)


def inject(name: str) -> None:
    """Press a button of the first camera."""
    set_control(0, name, 1)


def four() -> CameraArray:
    return camera_array(VIEWS)


def test_four_cameras_are_one():
    with four() as camera:
        taken = list(itertools.islice(camera.stream(), 10))
        dropped = dict(camera.dropped)
    assert all(tuple(f.view for f in multiview.frames) == VIEWS for multiview in taken)
    assert max(multiview.skew_s for multiview in taken) <= 0.05
    for before, after in itertools.pairwise(taken):
        assert after.timestamp_s > before.timestamp_s
        for earlier, later in zip(before.frames, after.frames, strict=True):
            assert later.sequence > earlier.sequence
    gaps = sum(taken[-1].frames[i].sequence - taken[0].frames[i].sequence - 9 for i in range(4))
    assert gaps <= sum(dropped.values())


def test_buffers_with_the_error_flag_are_dropped_and_counted():
    with one_camera() as camera:
        camera.grab(10.0)
        inject("inject_v4l2_buf_flag_error")
        next(camera.stream())
        list(itertools.islice(camera.stream(), 3))
        assert camera.dropped["damaged"] == 1


def test_a_fatal_streaming_error_is_overcome():
    with one_camera() as camera:
        before = camera.grab(10.0).frames[0]
        inject("inject_fatal_streaming_error")
        after = camera.grab(10.0).frames[0]
        assert camera.dropped["restart"] == 1
    assert after.sequence > before.sequence
    assert after.timestamp_s > before.timestamp_s


def test_an_error_of_queueing_is_overcome():
    with one_camera() as camera:
        camera.grab(10.0)
        inject("inject_vidioc_qbuf_error")
        camera.grab(10.0)
        assert camera.dropped["restart"] == 1


@pytest.mark.parametrize("name", ["inject_vidioc_reqbufs_error", "inject_vidioc_streamon_error"])
def test_a_stream_that_does_not_start_is_an_error_and_the_next_try_works(name: str):
    inject(name)
    failing = one_camera()
    with pytest.raises(DeviceLostError, match="does not start to stream"), failing as camera:
        camera.start()
    with one_camera() as camera:
        assert camera.grab(10.0).frames[0].image.shape == (180, 320)


def test_dropped_buffers_show_as_lost_frames():
    set_control(0, "percentage_of_dropped_buffers", 40)
    try:
        with one_camera() as camera:
            taken = [m.frames[0] for m in itertools.islice(camera.stream(), 12)]
            lost = camera.dropped["lost"]
    finally:
        set_control(0, "percentage_of_dropped_buffers", 0)
    assert lost > 0
    assert taken[-1].sequence - taken[0].sequence >= 12


def test_a_sequence_number_that_wraps_around_goes_on():
    set_control(0, "wrap_sequence_number", 1)
    try:
        with one_camera(rate_hz=60) as camera:
            taken = [m.frames[0].sequence for m in itertools.islice(camera.stream(), 150)]
    finally:
        set_control(0, "wrap_sequence_number", 0)
    assert taken == sorted(set(taken))
    assert taken[-1] < 10_000


def test_timestamps_of_another_time_are_not_used():
    set_control(0, "wrap_timestamp", 1)
    try:
        timed_out = pytest.raises(CaptureTimeoutError, match=r"\d+ timestamp")
        with one_camera() as camera, timed_out:
            camera.grab(1.0)
    finally:
        set_control(0, "wrap_timestamp", 0)


def test_the_source_of_the_timestamp_is_known():
    set_control(0, "timestamp_source", 1)
    try:
        with one_camera() as camera:
            at_start = camera.grab(10.0).frames[0]
    finally:
        set_control(0, "timestamp_source", 0)
    with one_camera() as camera:
        at_end = camera.grab(10.0).frames[0]
    assert at_start.uncertainty_s == 0.0
    assert at_end.uncertainty_s == pytest.approx(0.2)


def test_unplugged_in_the_middle_and_plugged_in_again():
    array = four()
    with array as camera:
        camera.grab(10.0)
        unplug_all()
        with pytest.raises(DeviceLostError, match="-vid-cap: was unplugged"):
            for _ in range(20):
                camera.grab(10.0)
    with pytest.raises(DeviceNotFoundError, match=r"4 of 4 did not open: .*is not there"):
        array.__enter__()
    plug_all()
    again = four()
    with again as camera:
        multiview = camera.grab(10.0)
    assert multiview.skew_s <= 0.2
    assert np.ptp(multiview.frames[2].image) > 50


def test_a_disconnect_of_one_camera_is_a_loss_of_that_one():
    array = four()
    with array as camera:
        camera.grab(10.0)
        set_control(2, "disconnect", 1)
        with pytest.raises(DeviceLostError, match="vivid-002-vid-cap: was unplugged"):
            for _ in range(20):
                camera.grab(10.0)
    with array as camera:  # vivid comes back when nobody holds it open any more
        assert len(camera.grab(10.0).frames) == 4
