"""The mechanics: play, ringing, slip, scale."""

import math

import pytest
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.motion import Phase, braking, trapezoid

from rig.profile import CarriageConfig


def make_carriage(**changes: float) -> Carriage:
    values: dict[str, float] = {
        "board_at_machine_zero_mm": 1000.0,
        "power_up_mm": -100.0,
        **changes,
    }
    return Carriage(CarriageConfig.model_validate(values), VirtualClock())


def move(start_s: float, from_mm: float, to_mm: float) -> tuple[Phase, ...]:
    return trapezoid(start_s, from_mm, to_mm, speed_mm_s=50.0, acceleration_mm_s2=400.0)


def test_a_trapezoid_takes_the_time_of_its_closed_form() -> None:
    phases = move(1.0, 0.0, 100.0)
    assert phases[-1].end_s - 1.0 == pytest.approx(100.0 / 50.0 + 50.0 / 400.0)
    assert phases[-1].end_mm == pytest.approx(100.0, abs=1e-9)
    assert phases[-1].end_velocity_mm_s == pytest.approx(0.0, abs=1e-9)


def test_a_short_move_never_reaches_its_speed() -> None:
    phases = move(0.0, 5.0, 4.0)
    assert len(phases) == 2
    assert phases[-1].end_s == pytest.approx(2.0 * math.sqrt(1.0 / 400.0))
    assert phases[0].end_velocity_mm_s == pytest.approx(-20.0)


def test_no_way_takes_no_phases() -> None:
    assert move(0.0, 5.0, 5.0) == ()


@pytest.mark.parametrize("wanted_mm", [0.0, 1.0, 50.0, 99.5, 100.0])
def test_a_phase_knows_when_it_passes_a_place(wanted_mm: float) -> None:
    times_s = [p.time_at_s(wanted_mm) for p in move(0.0, 0.0, 100.0)]
    passed_s = next(t for t in times_s if t is not None)
    phase = next(p for p in move(0.0, 0.0, 100.0) if passed_s <= p.end_s)
    assert phase.position_mm(passed_s) == pytest.approx(wanted_mm, abs=1e-6)


def test_braking_ends_at_rest() -> None:
    stop = braking(2.0, 10.0, -40.0, 400.0)
    assert stop.end_s == pytest.approx(2.1)
    assert stop.end_mm == pytest.approx(8.0)


def test_it_stands_where_power_came() -> None:
    assert make_carriage().travelled_mm(-5.0) == -100.0
    assert make_carriage().travelled_mm(5.0) == -100.0


def test_it_can_be_looked_up_within_a_move() -> None:
    carriage = make_carriage()
    carriage.follow(move(10.0, -100.0, 0.0))
    assert carriage.travelled_mm(10.0) == -100.0
    assert carriage.travelled_mm(10.0 + 0.125 + 1.0) == pytest.approx(-100.0 + 3.125 + 50.0)
    assert carriage.travelled_mm(99.0) == pytest.approx(0.0)


def test_the_scale_stretches_all_distances() -> None:
    carriage = make_carriage(scale=1.01)
    assert carriage.travelled_mm(0.0) == pytest.approx(-101.0)


def test_the_play_is_taken_up_when_the_direction_changes() -> None:
    carriage = make_carriage(backlash_mm=0.2)
    carriage.follow(move(0.0, -100.0, -50.0))
    assert carriage.travelled_mm(9.0) == pytest.approx(-50.0)
    carriage.follow(move(10.0, -50.0, -50.1))
    assert carriage.travelled_mm(19.0) == pytest.approx(-50.0), "still within the play"
    carriage.follow(move(20.0, -50.1, -60.0))
    assert carriage.travelled_mm(29.0) == pytest.approx(-59.8)
    carriage.follow(move(30.0, -60.0, -59.9))
    assert carriage.travelled_mm(39.0) == pytest.approx(-59.8), "still within the play"
    carriage.follow(move(40.0, -59.9, -50.0))
    assert carriage.travelled_mm(49.0) == pytest.approx(-50.0)


def test_it_rings_after_a_stop_and_calms_down() -> None:
    carriage = make_carriage(ring_mm=0.25, ring_hz=12.0, ring_decay_s=0.06)
    phases = move(0.0, -100.0, -50.0)
    carriage.follow(phases)
    quarter_s = phases[-1].end_s + 0.25 / 12.0
    expected_mm = 0.25 * math.exp(-0.25 / 12.0 / 0.06)
    assert carriage.travelled_mm(quarter_s) == pytest.approx(-50.0 + expected_mm)
    assert carriage.travelled_mm(phases[-1].end_s + 0.6) == pytest.approx(-50.0, abs=2e-5)


def test_a_new_plan_replaces_the_rest_of_the_old_one() -> None:
    carriage = make_carriage(ring_mm=0.25)
    phases = move(0.0, -100.0, -50.0)
    carriage.follow(phases)
    speed_mm_s = phases[1].velocity_mm_s
    stop = braking(0.5, phases[1].position_mm(0.5), speed_mm_s, 400.0)
    carriage.follow((stop,))
    assert carriage.travelled_mm(0.4) == pytest.approx(phases[1].position_mm(0.4))
    assert carriage.travelled_mm(60.0) == pytest.approx(stop.end_mm)


def test_a_motor_stopped_dead_loses_its_place() -> None:
    carriage = make_carriage(slip_mm=0.7)
    phases = move(0.0, -100.0, -50.0)
    carriage.follow(phases)
    carriage.halt(0.5, slips=True)
    counted_mm = phases[1].position_mm(0.5)
    assert carriage.travelled_mm(9.0) == pytest.approx(counted_mm + 0.7)
    carriage.follow(move(10.0, counted_mm, -60.0))
    assert carriage.travelled_mm(99.0) == pytest.approx(-60.0 + 0.7), "the error stays"


def test_a_motor_at_rest_loses_nothing() -> None:
    carriage = make_carriage(slip_mm=0.7)
    carriage.halt(5.0, slips=True)
    assert carriage.travelled_mm(9.0) == -100.0


def test_the_switch_closes_at_machine_zero() -> None:
    carriage = make_carriage(backlash_mm=0.2)
    assert carriage.switch_gap_mm() == pytest.approx(100.0)
    carriage.follow(move(0.0, -100.0, 0.0))
    assert carriage.switch_gap_mm() == 0.0
    carriage.follow(move(10.0, 0.0, -0.1))
    assert carriage.switch_gap_mm() == 0.0, "the play keeps it pressed"
    carriage.follow(move(20.0, -0.1, -1.0))
    assert carriage.switch_gap_mm() == pytest.approx(1.0)


def test_the_past_stays_as_it_was() -> None:
    carriage = make_carriage(backlash_mm=0.1, ring_mm=0.2)
    carriage.follow(move(0.0, -100.0, -90.0))
    before_mm = [carriage.travelled_mm(0.05 * i) for i in range(20)]
    carriage.follow(move(5.0, -90.0, -95.0))
    assert [carriage.travelled_mm(0.05 * i) for i in range(20)] == before_mm
