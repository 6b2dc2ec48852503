"""Aravis and the driver beside a GigE Vision camera on the loopback interface, and its faults."""

import itertools
from collections.abc import Callable
from typing import Any

import pytest
from rig_genicam.camera import GenicamCamera
from rig_genicam.config import GenicamCameraConfig

from rig.devices import SystemClock
from rig.errors import ConfigError, ControlError, DeviceLostError, DeviceNotFoundError
from rig.frames import Frame
from tests.support.gige.camera import Faults, GigeCamera
from tests.support.gige.library import aravis_library

ADDRESS = "127.0.0.31"
pytestmark = pytest.mark.xdist_group("gige")


def camera_of(device: str = ADDRESS, **more: Any) -> GenicamCamera:
    config = GenicamCameraConfig.model_validate(
        {
            **{"kind": "genicam", "devices": {"a": device}, "rate_hz": 50.0, "exposure_s": 0.004},
            **{"width_px": 64, "height_px": 48, "gain": 6.0, **more},
        }
    )
    return GenicamCamera(config, "a", library=aravis_library(), clock=SystemClock())


def frames_of(camera: GenicamCamera, count: int) -> list[Frame]:
    return [multiview.frames[0] for multiview in itertools.islice(camera.stream(), count)]


def usable(camera: GenicamCamera) -> bool:
    """Whether every picture that came was whole; on a busy machine some are read too late."""
    return not {reason for reason, count in camera.dropped.items() if count} - {"late"}


def test_pictures_come_whole_and_in_order_and_what_was_set_is_in_the_camera():
    with GigeCamera(ADDRESS) as device, camera_of() as camera:
        frames = frames_of(camera, 3)
        assert device.memory["ExposureTime"] == 4000.0
        assert device.memory["Gain"] == 6.0
        assert device.memory["OffsetX"] == 0
        assert device.memory["ExposureAuto"] == 0
        assert camera.identity["model"] == "Rig Wire"
        assert camera.identity["firmware"] == "7.2"
        assert camera.packets.received >= 15  # a leader, three payloads and a trailer each
        assert usable(camera)
    first = int(frames[0].image[0, 0])
    for place, frame in enumerate(frames):
        assert set(frame.image.ravel()) == {first + place}
        assert frame.exposure_s == 0.004
    assert [frame.sequence - frames[0].sequence for frame in frames] == [0, 1, 2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pixel_format", "bits", "has_colour"),
    [("Mono12", 12, False), ("Mono12p", 12, False), ("BayerRG8", 8, True), ("RGB8", 8, True)],
)
def test_every_layout_comes_through(pixel_format: str, bits: int, has_colour: bool):
    with GigeCamera(ADDRESS) as device, camera_of(pixel_format=pixel_format) as camera:
        (frame,) = frames_of(camera, 1)
        assert device.sent > 0
    assert frame.bits == bits
    assert len(set(frame.image.ravel())) == 1
    assert (frame.colour is not None) == has_colour


@pytest.mark.slow
def test_chunks_are_read_and_ticks_are_turned_into_time():
    with GigeCamera(ADDRESS, tick_hz=125_000_000) as device:
        opened = aravis_library().open(ADDRESS)
        try:
            for name, value in [("Width", 64), ("Height", 48), ("PixelFormat", "Mono8"),
                                ("TriggerMode", "Off"), ("ChunkModeActive", True)]:  # fmt: skip
                opened.write(name, value)
            for chunk in ("Timestamp", "FrameID", "ExposureTime"):
                opened.write("ChunkSelector", chunk)
                opened.write("ChunkEnable", True)
            opened.open_stream()
            opened.start()
            buffer = opened.next(2.0)
        finally:
            opened.close()
        assert buffer is not None
        assert buffer.trouble == ""
        assert buffer.chunks["FrameID"] == 1000.0
        assert buffer.chunks["ExposureTime"] == device.memory["ExposureTime"]
        assert buffer.chunks["Timestamp"] == pytest.approx(buffer.device_ns, abs=1000.0)
        assert abs(1e-9 * buffer.chunks["Timestamp"] - buffer.arrived_s) < 2.0
        assert set(buffer.data[: 64 * 48]) == {0}


@pytest.mark.slow
def test_a_packet_that_was_dropped_once_is_asked_for_again_and_the_picture_is_whole():
    faults = Faults(dropped_once={(frame, 2) for frame in range(80)})
    with GigeCamera(ADDRESS, faults=faults), camera_of() as camera:
        frames = frames_of(camera, 3)
        assert camera.packets.resent >= 3
        assert camera.packets.missing == 0
        assert usable(camera)
    assert all(len(set(frame.image.ravel())) == 1 for frame in frames)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (lambda faults: faults.dropped.add((23, 2)), "incomplete"),
        (lambda faults: faults.lost.update((22, 23, 24)), "lost"),
        (lambda faults: faults.lower.add(23), "damaged"),
    ],
)
def test_what_is_not_whole_is_counted_and_never_given(fault: Callable[[Faults], Any], reason: str):
    faults = Faults()
    fault(faults)
    with GigeCamera(ADDRESS, faults=faults), camera_of() as camera:
        frames = frames_of(camera, 6)
        while frames[-1].sequence < 28:
            frames += frames_of(camera, 1)
        dropped = dict(camera.dropped)
    assert dropped[reason] == (3 if reason == "lost" else 1)
    shown = [int(frame.image[0, 0]) for frame in frames]
    assert 23 not in shown
    assert all(len(set(frame.image.ravel())) == 1 for frame in frames)


@pytest.mark.slow
def test_the_counter_of_gige_vision_goes_on_from_its_end():
    features = {"ChunkModeActive": False}
    with GigeCamera(ADDRESS, first_frame_id=65520) as _, camera_of(features=features) as camera:
        frames = frames_of(camera, 6)
        assert camera.dropped["lost"] == 0
    assert [f.sequence - frames[0].sequence for f in frames] == [0, 1, 2, 3, 4, 5]


@pytest.mark.slow
def test_a_range_of_the_camera_is_told():
    told = r"asked for ExposureTime 200000 us, it takes 20 to 100000 us"
    with GigeCamera(ADDRESS), pytest.raises(ConfigError, match=told), camera_of(exposure_s=0.2):
        pass


@pytest.mark.slow
def test_a_camera_that_clips_is_told():
    faults = Faults(stored={"ExposureTime": lambda _: 2000.0})
    told = r"asked for ExposureTime 4000\.0, the camera applies 2000\.0"
    with GigeCamera(ADDRESS, faults=faults), pytest.raises(ControlError, match=told), camera_of():
        pass


@pytest.mark.slow
def test_a_camera_that_another_program_has_is_told():
    with GigeCamera(ADDRESS), camera_of() as first:
        told = "is controlled by another program"
        with pytest.raises(DeviceNotFoundError, match=told), camera_of():
            pass
        assert len(frames_of(first, 1)) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["W31", "bench-left", ADDRESS])
def test_a_serial_number_the_users_name_or_an_address_is_enough(name: str):
    with GigeCamera(ADDRESS, serial="W31", user_name="bench-left"), camera_of(name) as camera:
        assert len(frames_of(camera, 1)) == 1
        assert camera.identity["serial"] == "W31"


@pytest.mark.slow
def test_an_absent_camera_is_told_with_those_that_are_there():
    with GigeCamera(ADDRESS, serial="W31"):
        told = r"camera W99: is not there, found .*W31"
        with pytest.raises(DeviceNotFoundError, match=told), camera_of("W99"):
            pass
        told = r"camera 127\.0\.0\.99: cannot be opened"
        with pytest.raises(DeviceNotFoundError, match=told), camera_of("127.0.0.99"):
            pass


@pytest.mark.slow
def test_two_cameras_of_one_name_are_told():
    with (
        GigeCamera(ADDRESS, serial="W31"),
        GigeCamera("127.0.0.32", model="Other", serial="W31"),
        pytest.raises(DeviceNotFoundError, match="is the name of 2 cameras"),
        camera_of("W31"),
    ):
        pass


@pytest.mark.slow
def test_a_camera_that_goes_away_is_lost_and_can_be_opened_when_it_is_back():
    faults = Faults()
    with GigeCamera(ADDRESS, faults=faults) as device:
        camera = camera_of()
        with camera:
            frames_of(camera, 1)
            faults.is_gone = True
            with pytest.raises(DeviceLostError, match="does not answer any more"):
                camera.grab(0.5)
                camera.grab(8.0)
        faults.is_gone = False
        with camera:
            assert len(frames_of(camera, 1)) == 1
        assert device.memory["Width"] == 64
