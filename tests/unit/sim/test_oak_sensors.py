"""Simulated sensors of an OAK, frame by frame on a clock that only waiting moves.

Rates and exposures are powers of two, so that all times are exact.
"""

from typing import Any

import numpy as np
import pytest
from rig_sim.clock import VirtualClock
from rig_sim.oak import SensorFaults, SimOakRack, SimSensor, SimSensorFrame
from rig_sim.world import World

from rig.profile import OakCameraConfig
from rig.profile.load import load_profile
from tests.support.cameras import SMALL, Slide

PERIOD_S = 1.0 / 64.0
EXPOSURE_S = 1.0 / 128.0
FIRST, SECOND = "centre", "left"


def sensors(
    *overrides: str, at_s: float = 8.0, faults: SensorFaults | None = None, **changes: Any
) -> tuple[dict[str, SimSensor], VirtualClock, SimOakRack]:
    times = (f"camera.rate_hz={1.0 / PERIOD_S}", f"camera.exposure_s={EXPOSURE_S}")
    profile = load_profile("sim-oak", ("world.renderer=analytic", *SMALL, *times, *overrides))
    assert isinstance(profile.camera, OakCameraConfig)
    clock = VirtualClock(at_s)
    world = World(profile, clock=clock, carriage=Slide(), scene="board")
    by_view = {} if faults is None else {FIRST: faults}
    rack = SimOakRack(profile.camera, world, by_view, **changes)
    return dict(rack.sources()), clock, rack


def one(*overrides: str, **changes: Any) -> tuple[SimSensor, VirtualClock]:
    found, clock, _ = sensors(*overrides, **changes)
    return found[FIRST], clock


def taken(sensor: SimSensor, count: int) -> list[SimSensorFrame]:
    frames = [sensor.next_frame(1.0) for _ in range(count)]
    return [frame for frame in frames if frame is not None]


def test_a_frame_comes_when_its_exposure_has_ended_stamped_with_its_middle():
    sensor, clock = one()
    frames = taken(sensor, 3)
    assert clock.now_s() == 8.0 + 2.0 * PERIOD_S + EXPOSURE_S
    assert [frame.sequence for frame in frames] == [0, 1, 2]
    assert [frame.timestamp_s for frame in frames] == [
        8.0 + number * PERIOD_S + EXPOSURE_S / 2.0 for number in range(3)
    ]
    assert {frame.exposure_s for frame in frames} == {EXPOSURE_S}


def test_waiting_ends_in_time_without_a_frame_and_the_frame_comes_later():
    sensor, clock = one()
    assert sensor.next_frame(EXPOSURE_S / 2.0) is None
    assert clock.now_s() == 8.0 + EXPOSURE_S / 2.0
    frame = sensor.next_frame(EXPOSURE_S / 2.0)
    assert frame is not None, "it comes at the very end of the wait"
    assert frame.sequence == 0


@pytest.mark.parametrize(
    ("late_periods", "following"), [(1.0, 2), (1.5, 2), (2.5, 3), (3.0, 4), (6.25, 7)]
)
def test_a_slow_reader_loses_frames_and_no_time(late_periods: float, following: int):
    sensor, clock = one()
    taken(sensor, 1)
    clock.sleep_s(8.0 + (1.0 + late_periods) * PERIOD_S - clock.now_s())
    first, second = taken(sensor, 2)
    assert (first.sequence, second.sequence) == (1, following)
    assert second.timestamp_s == 8.0 + following * PERIOD_S + EXPOSURE_S / 2.0


def test_sensors_that_wait_for_a_pulse_begin_with_the_next():
    free, pulsed = (
        one(f"camera.sync={sync}", at_s=8.001)[0].began_s for sync in ("auto", "external")
    )
    assert free == 8.001
    assert pulsed == 8.0 + PERIOD_S
    assert one("camera.sync=ptp", at_s=8.001)[0].began_s == pulsed


def test_jitter_ends_at_a_fifth_of_a_period():
    sensor, _ = one(faults=SensorFaults(jitter_s=10.0))
    frames = taken(sensor, 20)
    off_s = [f.timestamp_s - 8.0 - f.sequence * PERIOD_S - EXPOSURE_S / 2.0 for f in frames]
    assert off_s[0] == 0.0
    assert max(off_s) == pytest.approx(0.2 * PERIOD_S, abs=1e-9)
    assert min(off_s) == pytest.approx(-0.2 * PERIOD_S, abs=1e-9)


def test_a_share_of_the_frames_is_lost_and_leaves_a_gap_in_the_numbers():
    sensor, _ = one(faults=SensorFaults(drop_share=0.5))
    frames = [sensor.next_frame(1.0) for _ in range(40)]
    arrived = [frame.sequence for frame in frames if frame is not None]
    assert arrived == [number for number, frame in enumerate(frames) if frame is not None]
    assert 8 < len(arrived) < 32
    assert taken(one(faults=SensorFaults(drop_share=1.0))[0], 9) == []


def test_a_sensor_may_fail_or_fall_silent_after_so_many_frames():
    failing, _ = one(faults=SensorFaults(raises_after=2))
    assert len(taken(failing, 2)) == 2
    with pytest.raises(RuntimeError, match="sensor fault after 2 frames"):
        failing.next_frame(1.0)
    silent, clock = one(faults=SensorFaults(stalls_after=2))
    assert len(taken(silent, 2)) == 2
    before_s = clock.now_s()
    assert silent.next_frame(0.5) is None
    assert clock.now_s() == before_s + 0.5


def test_faults_of_controls_show_in_what_is_told():
    faults = SensorFaults(exposure_ratio=0.5, iso=800, phase_s=EXPOSURE_S, controls_after=1)
    first, second = taken(one("camera.iso=200", faults=faults)[0], 2)
    assert (first.exposure_s, second.exposure_s) == (0.75 * EXPOSURE_S, 0.5 * EXPOSURE_S)
    assert first.timestamp_s == 8.0 + EXPOSURE_S + EXPOSURE_S / 4.0
    assert first.iso == 800


def test_a_sensor_without_faults_tells_what_it_was_asked_for():
    (frame,) = taken(one("camera.iso=200")[0], 1)
    assert (frame.iso, frame.lens_position, frame.white_balance_k) == (200, -1, 0)
    assert frame.temperature_degc == pytest.approx(25.0)
    asked = ("camera.lens_position=120", "camera.white_balance_k=4500")
    (frame,) = taken(one(*asked)[0], 1)
    assert (frame.lens_position, frame.white_balance_k) == (120, 4500)


def test_noise_is_that_of_the_seed_the_view_and_the_frame():
    first, second = (sensors()[0] for _ in range(2))
    once, again = (taken(found[FIRST], 2) for found in (first, second))
    np.testing.assert_array_equal(once[0].image, again[0].image)
    assert (once[0].image != once[1].image).mean() > 0.2
    assert (once[0].image != taken(first[SECOND], 1)[0].image).mean() > 0.2


def test_ten_bits_span_0_to_1023():
    coarse, fine = (taken(one(f"camera.pixels={kind}")[0], 1)[0] for kind in ("gray8", "raw10"))
    assert (coarse.image.dtype, fine.image.dtype) == (np.uint8, np.uint16)
    np.testing.assert_array_equal(fine.image, np.round(coarse.image * (1023.0 / 255.0)))


def test_a_rack_has_the_views_and_the_name_of_its_device():
    found, _, rack = sensors()
    assert list(found)[:2] == [FIRST, SECOND]
    assert len(found) == 4
    assert [sensor.number for sensor in found.values()] == [0, 1, 2, 3]
    assert rack.serial == "sim-oak oak"
    found, _, rack = sensors(device="sim://other", views=(SECOND,))
    assert {name: sensor.number for name, sensor in found.items()} == {SECOND: 1}
    assert rack.serial == "sim-oak other"
