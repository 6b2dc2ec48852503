"""One GenICam device as a camera, over a device in memory and in simulated time."""

import itertools
from typing import Any

import pytest
from rig_genicam.camera import GenicamCamera
from rig_genicam.door import Buffer, Packets
from rig_sim.clock import VirtualClock

from rig.check.locks import unlocked
from rig.errors import CaptureTimeoutError, ConfigError, DeviceLostError, DeviceNotFoundError
from tests.support.genicam_device import MemoryDevice, MemoryLibrary, buffer
from tests.unit.drivers.genicam.test_settings import config_of


def camera_of(**more: Any) -> tuple[GenicamCamera, MemoryDevice]:
    clock = VirtualClock(100.0)
    device = MemoryDevice(clock)
    config = config_of(exposure_s=0.004, timeout_s=1.0, **more)
    return GenicamCamera(config, "a", library=MemoryLibrary({"M1": device}), clock=clock), device


def test_a_frame_is_what_came_at_the_middle_of_its_exposure():
    camera, device = camera_of()
    device.buffers.append(buffer(7, 100.2))
    with camera:
        (frame,) = camera.grab(1.0).frames
    assert (frame.view, frame.sequence, frame.bits) == ("a", 0, 8)
    assert frame.image.shape == (16, 32)
    assert set(frame.image.ravel()) == {7}
    assert frame.timestamp_s == pytest.approx(100.198)
    assert frame.exposure_s == 0.004
    assert frame.uncertainty_s == pytest.approx(0.05)  # one period: the way is not known
    assert frame.began_s == pytest.approx(100.146)


def test_a_grab_passes_over_what_may_have_begun_before_it():
    camera, device = camera_of()
    device.buffers.extend(buffer(n, 100.0 + 0.02 * n) for n in range(1, 6))
    with camera:
        (frame,) = camera.grab(1.0).frames
    assert set(frame.image.ravel()) == {3}  # the first that came 54 ms or more after the call


def test_an_unknown_exposure_may_have_lasted_a_period_as_well():
    camera, device = camera_of()
    device.features["ExposureTime"] = 10000.0
    camera = GenicamCamera(
        config_of(timeout_s=1.0), "a", library=MemoryLibrary({"M1": device}), clock=device.clock
    )
    device.buffers.append(buffer(1, 100.3))
    with camera:
        (frame,) = camera.grab(1.0).frames
    assert frame.exposure_s is None
    assert (frame.timestamp_s, frame.uncertainty_s) == pytest.approx((100.3, 0.1))


def test_chunks_tell_time_number_and_exposure():
    camera, device = camera_of()
    told = [
        {"Timestamp": 5e9 + 5e7 * n, "FrameID": 900.0 + 2 * n, "ExposureTime": 6e3} for n in (1, 2)
    ]
    device.buffers.extend(
        [
            buffer(1, 100.3, chunks=told[0], device_ns=1),
            buffer(2, 100.39, chunks=told[1], device_ns=2),
        ]
    )
    with camera:
        first, second = itertools.islice(camera.stream(), 2)
    assert first.frames[0].exposure_s == 0.006
    assert first.frames[0].timestamp_s == pytest.approx(100.297)
    assert second.frames[0].timestamp_s == pytest.approx(100.347)  # evened: it came 40 ms late
    assert second.frames[0].sequence == 2


def test_frames_of_the_first_fifth_of_a_second_only_tell_how_the_clock_stands():
    camera, device = camera_of()
    device.buffers.extend(
        buffer(n, 100.0 + 0.05 * n + late_s, device_ns=50_000_000 * n)
        for n, late_s in enumerate((0.030, 0.0, 0.030, 0.010, 0.020), start=1)
    )
    with camera:
        first, second = itertools.islice(camera.stream(), 2)
        assert camera.dropped == {"lost": 0}
    assert (first.frames[0].sequence, second.frames[0].sequence) == (3, 4)
    assert first.frames[0].timestamp_s == pytest.approx(100.198)
    assert second.frames[0].timestamp_s == pytest.approx(100.248)


def bad(**changed: Any) -> Buffer:
    values = {slot: getattr(buffer(2, 100.15), slot) for slot in Buffer.__dataclass_fields__}
    return Buffer(**{**values, **changed})


@pytest.mark.parametrize(
    ("found", "dropped"),
    [
        (bad(trouble="packets are missing"), {"incomplete": 1, "lost": 0}),
        (bad(height_px=8), {"damaged": 1, "lost": 0}),
        (bad(pixel_bits=16), {"damaged": 1, "lost": 0}),
        (bad(data=buffer(2, 0.0).data[:-1]), {"damaged": 1, "lost": 0}),
        (bad(frame_id=1), {"duplicate": 1, "lost": 1}),
    ],
)
def test_what_is_not_whole_is_counted_and_never_given(found: Buffer, dropped: dict[str, int]):
    camera, device = camera_of()
    device.buffers.extend([buffer(1, 100.1), found, buffer(3, 100.2)])
    with camera:
        taken = [multiview.frames[0].sequence for multiview in itertools.islice(camera.stream(), 2)]
        assert camera.dropped == dropped
    assert taken == [0, 2]


def test_numbers_that_never_came_are_lost():
    camera, device = camera_of()
    device.buffers.extend([buffer(1, 100.1), buffer(5, 100.3)])
    with camera:
        list(itertools.islice(camera.stream(), 2))
        assert camera.dropped == {"lost": 3}


def test_frames_that_waited_are_late_and_the_newest_is_given():
    camera, device = camera_of()
    device.buffers.extend(buffer(n, 100.0 + 0.05 * n) for n in range(1, 9))
    with camera:
        stream = camera.stream()
        next(stream)
        device.clock.sleep_s(0.3)
        assert next(stream).frames[0].sequence == 5
        assert camera.dropped["late"] == 4


def test_a_silent_camera_ends_in_a_timeout_that_tells_what_came():
    camera, device = camera_of()
    device.buffers.append(bad(trouble="packets are missing"))
    told = r"asked for all views within 0\.40 s, nothing usable \(1 incomplete\) came from a"
    with camera, pytest.raises(CaptureTimeoutError, match=told):
        camera.grab(0.4)
    assert device.clock.now_s() == pytest.approx(100.4)


def test_a_camera_that_is_gone_is_told_and_can_be_opened_again():
    camera, device = camera_of()
    with camera:
        device.is_gone = True
        with pytest.raises(DeviceLostError, match="does not answer any more"):
            camera.grab(0.5)
    assert not device.is_open
    device.is_gone = False
    device.buffers.append(buffer(1, device.clock.now_s() + 0.1))
    with camera:
        assert camera.grab(0.5).frames[0].sequence == 0


def test_an_absent_camera_is_not_found():
    camera = GenicamCamera(config_of(), "b", library=MemoryLibrary({}), clock=VirtualClock())
    with pytest.raises(DeviceNotFoundError, match="camera M2: is not there"), camera:
        pass


def test_a_camera_that_cannot_be_set_up_is_closed_again():
    camera, device = camera_of(gain=99.0)
    with pytest.raises(ConfigError), camera:
        pass
    assert not device.is_open


def test_pictures_start_once():
    camera, device = camera_of()
    device.buffers.append(buffer(1, 100.3))
    with camera:
        assert device.writes[-1] == ("stream", True)
        camera.start()
        camera.start()
        camera.grab(1.0)
    assert device.writes.count(("start", True)) == 1


def test_software_triggers_fire_at_whole_periods_of_the_clock_and_bound_the_exposure():
    camera, device = camera_of(trigger={"source": "Software"})
    device.clock.sleep_s(0.013)
    numbers = itertools.count(1)
    device.answer = lambda fired_s: buffer(next(numbers), fired_s + 0.010)
    with camera:
        taken = [multiview.frames[0] for multiview in itertools.islice(camera.stream(), 3)]
    assert device.fired_s == pytest.approx([100.05, 100.1, 100.15])
    # 10 ms from the trigger to the first bytes, 4 of them exposure: 6 ms are not known.
    assert [frame.uncertainty_s for frame in taken] == pytest.approx([0.006] * 3)
    assert [frame.timestamp_s for frame in taken] == pytest.approx([100.058, 100.108, 100.158])


def test_a_trigger_without_an_answer_makes_the_next_frame_less_certain():
    camera, device = camera_of(trigger={"source": "Software"})
    answers = itertools.count(1)

    def answered(fired_s: float) -> Buffer:
        number = next(answers)
        return buffer(number, fired_s + 0.01, trouble="packets are missing" if number == 1 else "")

    device.answer = answered
    with camera:
        first, second = itertools.islice(camera.stream(), 2)
    assert first.frames[0].uncertainty_s == pytest.approx(0.05)  # never more than a period
    assert second.frames[0].uncertainty_s == pytest.approx(0.006)


def test_a_camera_that_takes_no_rate_is_told_where_it_runs_at_another():
    camera, device = camera_of()
    del device.features["AcquisitionFrameRate"]
    device.buffers.extend(buffer(n, 100.0 + 0.1 * n) for n in range(1, 9))
    told = r"asked for 20 Hz, frames come at 10 Hz, .* lower camera\.exposure_s or the size"
    with camera, pytest.raises(ConfigError, match=told):
        list(itertools.islice(camera.stream(), 8))


def test_what_is_left_to_the_camera_is_found_by_the_check():
    device = MemoryDevice(VirtualClock(100.0))
    camera = GenicamCamera(
        config_of(), "a", library=MemoryLibrary({"M1": device}), clock=device.clock
    )
    with camera:
        assert unlocked(config_of(), camera.identity) == ["exposure_s", "gain"]
        assert unlocked(config_of(exposure_s=0.004, gain=1.0), camera.identity) == []


def test_it_says_who_it_is_what_was_set_and_what_the_network_did():
    camera, device = camera_of()
    assert camera.identity == {"kind": "genicam", "model": "", "serial": "M1"}
    with camera:
        assert camera.identity["model"] == "Rig Memory"
        assert camera.identity["controls"].startswith("PixelFormat=Mono8 Width=32 Height=16 ")
        assert "ExposureTime=4000.0" in camera.identity["controls"]
        assert "packets" not in camera.identity
        device.packets = Packets(received=90, missing=2, resent=3)
        assert camera.identity["packets"] == "90 received, 2 missing, 3 resent"
    assert camera.packets == Packets()


def test_frames_from_before_a_stream_give_it_no_further_time():
    """A camera that tells exposures of 20 s, so that each began before the call."""
    camera, device = camera_of()
    told = {"ExposureTime": 2e7}
    device.buffers.extend(buffer(n, 100.0 + 0.3 * n, chunks=told) for n in range(1, 30))
    with camera, pytest.raises(CaptureTimeoutError, match=r"within 1\.0"):
        next(camera.stream())
    assert device.clock.now_s() == pytest.approx(101.0, abs=0.26)
