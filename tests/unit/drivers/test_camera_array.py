"""Several cameras as one, in real time, over devices that come and go."""

import itertools
import threading
import time
from collections import deque
from dataclasses import replace

import pytest
from rig_drivers.array.camera_array import CameraArray
from rig_drivers.v4l2 import abi

from rig.errors import (
    CaptureTimeoutError,
    ConfigError,
    DeviceLostError,
    DeviceNotFoundError,
    DevicesNotFoundError,
    ViewSkewError,
)
from tests.support.cameras import SMALL, SmallRig
from tests.support.video_arrays import VIDEO_PERIOD_S, locked, video_array
from tests.support.video_kernel import FakeDevice

VIEWS = ("left", "right", "top")


def test_all_are_opened_side_by_side():
    all_there = threading.Barrier(len(VIEWS), timeout=20.0)

    def waiting(number: int) -> FakeDevice:
        return replace(locked(number), on_open=all_there.wait)

    array, _, _ = video_array(VIEWS, waiting)
    with array as camera:
        assert not all_there.broken
        assert len(camera.grab(10.0).frames) == 3


def test_one_camera_that_is_not_there_closes_the_others():
    array, devices, _ = video_array(VIEWS)
    devices[1].is_plugged = False
    with pytest.raises(DeviceNotFoundError, match="by-path/right: is not there"), array:
        pass
    devices[1].is_plugged = True
    with array as camera:
        assert len(camera.grab(10.0).frames) == 3


def test_of_several_that_are_not_there_all_are_told():
    array, devices, _ = video_array(VIEWS)
    devices[0].is_plugged = devices[2].is_plugged = False
    with pytest.raises(DevicesNotFoundError) as caught, array:
        pass
    names = [f"camera /dev/v4l/by-path/{VIEWS[i]}" for i in (0, 2)]
    told = f"camera array: 2 of 3 did not open: {', '.join(names)}: is not there"
    assert caught.value.found == told
    assert caught.value.advice.startswith("plug it in")


def test_a_stream_that_does_not_start_closes_all():
    array, devices, _ = video_array(VIEWS)
    devices[1].failing[abi.VIDIOC_STREAMON] = deque([28])
    with pytest.raises(DeviceLostError, match="right: does not start to stream"), array:
        pass
    with array as camera:
        assert len(camera.grab(10.0).frames) == 3


def test_an_unplugged_camera_ends_grab_and_stream_until_opened_again():
    array, devices, _ = video_array(VIEWS)
    with array as camera:
        stream = camera.stream()
        next(stream)
        devices[2].is_plugged = False
        with pytest.raises(DeviceLostError, match="by-path/top: was unplugged"):
            for _ in range(10):
                next(stream)
        with pytest.raises(DeviceLostError, match="by-path/top"):
            camera.grab(10.0)
    devices[2].is_plugged = True
    with array as camera:
        assert len(camera.grab(10.0).frames) == 3


def test_a_silent_camera_is_named():
    array, devices, _ = video_array(VIEWS, timeout_s=0.2)
    devices[1].is_silent = True
    with array as camera:
        with pytest.raises(CaptureTimeoutError, match="came from right;") as caught:
            camera.grab(0.3)
        assert caught.value.missing == ("right",)
        with pytest.raises(CaptureTimeoutError, match="came from right;"):
            next(camera.stream())


def test_a_camera_that_comes_back_after_a_silence_is_paired_again():
    array, devices, _ = video_array(VIEWS, timeout_s=0.2)
    with array as camera:
        camera.grab(10.0)
        devices[1].is_silent = True
        with pytest.raises(CaptureTimeoutError):
            camera.grab(0.3)
        devices[1].is_silent = False
        assert camera.grab(10.0).skew_s < 0.005


def shifted(number: int) -> FakeDevice:
    return replace(locked(number), phase_s=(0.0, 0.45 * VIDEO_PERIOD_S)[number])


def test_cameras_out_of_step_are_told_so():
    array, _, _ = video_array(VIEWS[:2], shifted, timeout_s=0.4)
    with array as camera:
        with pytest.raises(ViewSkewError, match=r"18\.0\d ms apart, allowed 5\.00 ms"):
            camera.grab(0.4)
        assert camera.dropped["skew"] > 0
        assert camera.dropped_by_view()["left"]["skew"] > 0


def test_in_front_of_a_static_scene_cameras_out_of_step_can_be_grabbed_but_not_streamed():
    array, _, _ = video_array(VIEWS[:2], shifted, max_skew_s=0.03, timeout_s=0.4)
    with array as camera:
        called_s = time.monotonic()
        multiview = camera.grab(10.0)
        assert all(frame.began_s >= called_s for frame in multiview.frames)
        assert multiview.skew_s == pytest.approx(0.018, abs=0.001)
        with pytest.raises(ViewSkewError, match=r"18\.0\d ms apart, allowed 10\.00 ms"):
            next(camera.stream())


def test_lost_frames_are_dropped_with_a_reason_and_never_mixed():
    def losing(number: int) -> FakeDevice:
        lost = ({4}, {6, 7}, set[int]())[number]
        return replace(locked(number), lost=lost)

    array, _, _ = video_array(VIEWS, losing)
    with array as camera:
        taken = list(itertools.islice(camera.stream(), 12))
        assert camera.dropped["lost"] >= 3
        assert camera.dropped["unpaired"] >= 4
    for multiview in taken:
        assert multiview.skew_s < 0.001


def test_a_slow_reader_loses_the_oldest_and_gets_the_newest():
    array, _, _ = video_array(VIEWS)
    with array as camera:
        stream = camera.stream()
        before = next(stream)
        while camera.dropped.get("late", 0) < 5:
            time.sleep(0.1 * VIDEO_PERIOD_S)
        after = next(stream)
        assert after.frames[0].sequence > before.frames[0].sequence + 5


def test_identity_tells_what_each_view_is():
    array, _, _ = video_array(VIEWS)
    with array as camera:
        identity = camera.identity
    assert identity["model"] == "3 x v4l2"
    assert identity["left.model"] == "Fake camera"
    assert identity["top.mode"] == "GREY 32 x 24 at 25 Hz"


def test_views_must_be_those_of_the_cameras():
    with pytest.raises(ConfigError, match="asked for the views left, found centre, left, right"):
        CameraArray(
            [SmallRig(SMALL).camera()], views=["left"], period_s=0.1, max_skew_s=0.1, timeout_s=1.0
        )
