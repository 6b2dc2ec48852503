"""A loop in real time, where threads take and rectify beside the program."""

import itertools
import threading
from pathlib import Path

import pytest
from rig_sim.faults import FaultyCamera, UnpluggedCamera
from rig_sim.world import World

from rig.devices import Camera, SystemClock
from rig.errors import CaptureTimeoutError, DeviceLostError
from rig.live.camera import DepthCamera
from tests.unit.live.devices import Gated, Wrap, tiny_rig
from tests.unit.live.test_camera import in_thread, stored_rig


def real_rig(wrap: Wrap = lambda camera, _: camera, *overrides: str) -> DepthCamera:
    return tiny_rig(wrap, *overrides, clock=SystemClock())[0]


def threads() -> list[str]:
    return [t.name for t in threading.enumerate() if t.name in ("take", "rectify")]


def test_each_frame_is_newer_and_every_one_in_between_counts():
    with real_rig() as camera:
        seen = [frame.views.frames[0].sequence for frame in itertools.islice(camera, 5)]
        assert threads() == []
        assert seen == sorted(set(seen))
        missed = seen[-1] - seen[0] - 4
        assert missed <= sum(camera.dropped.values())
    assert camera.waited_s > 0.0


def test_a_loop_that_is_left_leaves_no_thread_and_another_one_goes_on():
    with real_rig() as camera:
        for frame in camera:
            assert sorted(threads()) == ["rectify", "take"]
            if frame.index == 1:
                break
        assert threads() == []
        assert [frame.index for frame in itertools.islice(camera, 2)] == [2, 3]


def test_two_loops_of_one_thread_share_the_frames():
    with real_rig() as camera:
        one, other = iter(camera), iter(camera)
        assert [next(one).index, next(other).index, next(one).index] == [0, 1, 2]
        one.close()
        assert next(other).index == 3
        other.close()
        assert threads() == []


def test_a_grab_within_a_loop_is_exposed_after_the_call():
    clock = SystemClock()
    with real_rig() as camera:
        for frame in itertools.islice(camera, 3):
            called_s = clock.now_s()
            grabbed = camera.grab()
            assert min(f.began_s for f in grabbed.views.frames) >= called_s
            assert grabbed.index == frame.index + 1


def test_latency_counts_from_mid_exposure_and_holds_the_time_of_measuring():
    clock = SystemClock()
    with real_rig() as camera:
        for frame in itertools.islice(camera, 3):
            age_s = clock.now_s() - frame.views.timestamp_s
            # Mid-exposure is 4 ms before a picture can be handed over.
            assert 0.004 + frame.measuring_s <= frame.latency_s <= age_s
            assert frame.measuring_s > 0.0


def test_closing_from_another_thread_ends_a_loop_that_waits_for_the_camera():
    made: list[Gated] = []

    def wrap(camera: Camera, _: World) -> Gated:
        made.append(Gated(camera))
        return made[0]

    seen: list[int] = []
    with real_rig(wrap) as camera:
        looping, errors = in_thread(lambda: seen.extend(frame.index for frame in camera))
        (gated,) = made
        assert gated.is_waiting.wait(60.0)
        closing, more = in_thread(camera.close)
        gated.gate.set()
        for thread in (closing, looping):
            thread.join(60.0)
            assert not thread.is_alive()
    assert errors == more == []
    assert seen in ([], [0])
    assert gated.closed == 1
    assert threads() == []


def test_a_grab_gives_up_on_a_camera_that_is_silent_in_a_loop():
    made: list[Gated] = []

    def wrap(camera: Camera, _: World) -> Gated:
        made.append(Gated(camera))
        return made[0]

    with real_rig(wrap) as camera:
        frames = iter(camera)
        next(frames)
        assert made[0].is_waiting.wait(60.0)
        with pytest.raises(CaptureTimeoutError, match=r"within 0\.01 s"):
            camera.grab(0.01)
        made[0].gate.set()
        frames.close()


def test_a_camera_that_comes_back_goes_on_and_one_that_does_not_ends_the_loop():
    def unplugged(camera: Camera, world: World) -> FaultyCamera:
        return FaultyCamera(
            camera, UnpluggedCamera(after=1), clock=world.clock, max_skew_s=0.005, timeout_s=3.0
        )

    with real_rig(unplugged, "camera.reconnect_s=60.0") as camera:
        assert [frame.index for frame in itertools.islice(camera, 2)] == [0, 1]
        assert camera.dropped["reconnect"] >= 1
    seen: list[int] = []
    with real_rig(unplugged) as camera, pytest.raises(DeviceLostError, match="stopped answering"):
        seen.extend(frame.index for frame in camera)
    assert seen == [0]
    assert threads() == []


def test_a_grab_in_a_loop_over_stored_pictures_gives_the_next_one(tmp_path: Path):
    with stored_rig(tmp_path, 5) as camera:
        frames = iter(camera)
        shown = [next(frames), camera.grab(), next(frames)]
        frames.close()
        shown += [camera.grab(), *camera]
        assert [frame.views.frames[0].sequence for frame in shown] == [0, 1, 2, 3, 4]
        with pytest.raises(DeviceLostError, match="holds 5"):
            camera.grab()
    assert camera.dropped == {"skew": 0}
