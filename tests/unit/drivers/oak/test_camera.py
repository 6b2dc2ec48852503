"""The OAK driver over a real DepthAI pipeline: four simulated sensors, each with its own faults."""

import itertools
import time

import numpy as np
import pytest
from rig_sim.oak import SensorFaults

from rig.errors import (
    CaptureTimeoutError,
    ControlError,
    DeviceLostError,
    ViewSkewError,
)
from tests.support.oak import OakRig

ALL = ("centre", "left", "right", "top")


def test_pairs_of_sensors_that_jitter_and_drop_are_right_and_every_loss_is_counted():
    faults = {view: SensorFaults(jitter_s=0.001, drop_share=0.15) for view in ALL}
    rig = OakRig(("camera.max_skew_s=0.008",), faults)
    with rig.camera() as camera:
        taken = list(itertools.islice(camera.stream(), 16))
        dropped = camera.dropped
    for multiview in taken:
        assert multiview.skew_s < 0.008  # half a period is 0.010
        assert multiview.temperature_degc == pytest.approx(25.0)
    assert dropped["unpaired"] > 0
    numbers = [multiview.frames[0].sequence for multiview in taken]
    gaps = sum(after - before - 1 for before, after in itertools.pairwise(numbers))
    assert gaps == dropped["unpaired"] + dropped["late"] + dropped["skew"]


def test_a_stalled_sensor_is_named_and_the_others_go_on():
    rig = OakRig((), {"right": SensorFaults(stalls_after=8)})
    with rig.camera() as camera:
        with pytest.raises(CaptureTimeoutError) as caught:
            for _ in range(20):
                camera.grab(1.0)
        assert caught.value.missing == ("right",)
        with pytest.raises(CaptureTimeoutError, match="nothing came from right;"):
            camera.grab(0.2)


def test_an_exception_in_a_sensor_node_is_a_lost_device_and_not_the_end_of_the_process():
    rig = OakRig(("camera.reconnects=0",), {"left": SensorFaults(raises_after=6)})
    with rig.camera() as camera, pytest.raises(DeviceLostError, match="sensor fault after 6"):
        for _ in range(20):
            camera.grab(10.0)


def test_a_pipeline_that_the_library_ends_is_a_lost_device():
    """As when the link breaks: queues close under the reader."""
    with OakRig(("camera.reconnects=0",)).camera() as camera:
        camera.grab(10.0)
        streams = camera._streams
        assert streams is not None
        assert streams._pipeline is not None
        streams._pipeline.stop()
        with pytest.raises(DeviceLostError, match="open it again"):
            for _ in range(5):
                camera.grab(10.0)
    with camera:
        assert len(camera.grab(10.0).frames) == 4


def test_a_stream_finds_a_lost_device_again():
    rig = OakRig((), {"left": SensorFaults(raises_after=12)})
    with rig.camera() as camera:
        taken = list(itertools.islice(camera.stream(), 14))
        assert camera.dropped["reconnect"] >= 1
    numbers = [multiview.frames[0].sequence for multiview in taken]
    assert numbers == sorted(set(numbers))


def test_a_control_that_the_sensor_clips_is_refused_at_opening():
    rig = OakRig(("camera.timeout_s=0.1",), {"top": SensorFaults(exposure_ratio=0.5)})
    with pytest.raises(ControlError, match=r"view top: asked for exposure_s 0\.008000 s") as caught:
        rig.camera().__enter__()
    assert caught.value.applied == "0.004000 s"
    gain = OakRig(("camera.timeout_s=0.1",), {"left": SensorFaults(iso=400)})
    with pytest.raises(ControlError, match="iso 100, the camera applies 400"):
        gain.camera().__enter__()


def test_frames_from_before_the_controls_took_hold_are_passed_over():
    rig = OakRig((), {"centre": SensorFaults(controls_after=5)})
    with rig.camera() as camera:
        assert camera.grab(10.0).frames[0].exposure_s == pytest.approx(0.008)


def test_sensors_out_of_step_are_refused_with_their_skew():
    rig = OakRig(
        ("camera.max_skew_s=0.002", "camera.timeout_s=0.3"), {"right": SensorFaults(phase_s=0.006)}
    )
    with rig.camera() as camera:
        with pytest.raises(ViewSkewError, match=r"6\.00 ms apart, allowed 2\.00 ms"):
            camera.grab(10.0)
        with pytest.raises((ViewSkewError, CaptureTimeoutError)):
            next(camera.stream())
        assert camera.dropped["skew"] > 0


def test_sensors_half_a_period_apart_are_never_paired():
    overrides = ("camera.max_skew_s=0.002", "camera.timeout_s=0.1")
    rig = OakRig(overrides, {"right": SensorFaults(phase_s=0.010)})
    with pytest.raises(ViewSkewError, match=r"allowed 2\.00 ms"):
        rig.camera().__enter__()


def test_raw_pixels_are_the_same_picture_in_ten_bits():
    with OakRig(("world.seed=3",)).camera() as camera:
        grey = np.stack(camera.grab(10.0).images).astype(float)
    with OakRig(("world.seed=3", "camera.pixels=raw10")).camera() as camera:
        raw = np.stack(camera.grab(10.0).images)
    assert raw.dtype == np.uint16
    assert np.abs(raw / 1023.0 - grey / 255.0).mean() < 0.01


def test_a_grab_after_a_move_shows_the_board_where_it_is_now():
    rig = OakRig()
    with rig.camera() as camera:
        before = np.stack(camera.grab(10.0).images).astype(float)
        rig.slide.at_mm = -300.0
        moved = np.stack(camera.grab(10.0).images).astype(float)
        rig.slide.at_mm = -603.0
        back = np.stack(camera.grab(10.0).images).astype(float)
    noise = np.abs(back - before).mean()
    assert np.abs(moved - before).mean() > 5.0 * noise


def test_a_slow_reader_of_a_stream_loses_the_oldest_and_blocks_nobody():
    with OakRig().camera() as camera:
        stream = camera.stream()
        before = next(stream)
        recent = before
        while camera.dropped["late"] < 3:
            time.sleep(0.1)  # five periods
            recent = next(stream)
        assert recent.frames[0].sequence > before.frames[0].sequence + 3


def test_leaving_the_camera_ends_its_stream():
    with OakRig().camera() as camera:
        stream = camera.stream()
        next(stream)
    with pytest.raises(DeviceLostError, match="not open"):
        next(stream)
