"""Motion in closed form: every phase by its numbers, ends and borders included."""

import math

import pytest
from rig_sim.motion import SLACK_MM, Phase, braking, trapezoid

UP = Phase(2.0, 4.0, 10.0, 3.0, 5.0)
"""From 2 s to 4 s, from 10 mm on at 3 mm/s, 5 mm/s2 faster every second: 16 mm further."""
CRUISE = Phase(1.0, 3.0, 100.0, -20.0, 0.0)


@pytest.mark.parametrize(
    ("t_s", "position_mm", "velocity_mm_s"),
    [(1.0, 10.0, 3.0), (2.0, 10.0, 3.0), (3.0, 15.5, 8.0), (4.0, 26.0, 13.0), (9.0, 26.0, 13.0)],
)
def test_a_phase_is_a_parabola_between_its_ends(
    t_s: float, position_mm: float, velocity_mm_s: float
):
    assert UP.position_mm(t_s) == position_mm
    assert UP.velocity_mm_s_at(t_s) == velocity_mm_s
    assert (UP.end_mm, UP.end_velocity_mm_s) == (26.0, 13.0)


@pytest.mark.parametrize(("t_s", "end_s"), [(1.0, 2.0), (2.5, 2.5), (7.0, 4.0)])
def test_a_phase_is_cut_within_its_ends(t_s: float, end_s: float):
    assert UP.until(t_s) == Phase(2.0, end_s, 10.0, 3.0, 5.0)


def test_a_phase_in_other_coordinates_is_scaled_and_then_shifted():
    assert UP.mapped(scale=-2.0, shift_mm=7.0) == Phase(2.0, 4.0, -13.0, -6.0, -10.0)


@pytest.mark.parametrize(
    ("phase", "position_mm", "time_s"),
    [
        (UP, 10.0, 2.0),
        (UP, 15.5, 3.0),
        (UP, 26.0, 4.0),
        (CRUISE, 100.0, 1.0),
        (CRUISE, 80.0, 2.0),
        (CRUISE, 60.0, 3.0),
        (Phase(1.0, 2.0, 0.0, -8.0, 8.0), -3.0, 1.5),
    ],
)
def test_a_place_within_is_passed_at_its_time(phase: Phase, position_mm: float, time_s: float):
    assert phase.time_at_s(position_mm) == pytest.approx(time_s, abs=1e-12)


@pytest.mark.parametrize("phase", [UP, CRUISE])
def test_a_place_beyond_an_end_is_passed_within_the_slack_only(phase: Phase):
    low_mm, high_mm = sorted((phase.start_mm, phase.end_mm))
    for end_mm, outwards in ((low_mm, -1.0), (high_mm, 1.0)):
        assert phase.time_at_s(end_mm + 0.5 * outwards * SLACK_MM) is not None
        assert phase.time_at_s(end_mm + 3.0 * outwards * SLACK_MM) is None


def test_a_phase_at_rest_passes_its_place_at_once():
    assert Phase(5.0, 5.0, 1.0, 0.0, 0.0).time_at_s(1.0) == 5.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_long_way_is_ramp_cruise_and_ramp(sign: float):
    # 50 mm/s at 400 mm/s2 takes 0.125 s and 3.125 mm; 93.75 mm between the ramps take 1.875 s.
    up, cruise, down = trapezoid(
        1.0, 20.0, 20.0 + sign * 100.0, speed_mm_s=50.0, acceleration_mm_s2=400.0
    )
    assert up == Phase(1.0, 1.125, 20.0, 0.0, sign * 400.0)
    assert cruise == Phase(1.125, 3.0, 20.0 + sign * 3.125, sign * 50.0, 0.0)
    assert down == Phase(3.0, 3.125, 20.0 + sign * 96.875, sign * 50.0, -sign * 400.0)
    assert down.end_mm == 20.0 + sign * 100.0


def test_a_way_that_just_reaches_its_speed_has_no_cruise():
    phases = trapezoid(0.0, 0.0, 6.25, speed_mm_s=50.0, acceleration_mm_s2=400.0)
    assert phases == (
        Phase(0.0, 0.125, 0.0, 0.0, 400.0),
        Phase(0.125, 0.25, 3.125, 50.0, -400.0),
    )


def test_a_short_way_turns_at_its_middle():
    up, down = trapezoid(0.0, 0.0, -1.0, speed_mm_s=50.0, acceleration_mm_s2=400.0)
    assert (up.end_s, up.end_mm) == (0.05, pytest.approx(-0.5))
    assert (down.end_s, down.end_mm) == (0.1, pytest.approx(-1.0))
    assert down.start_mm == -0.5
    assert down.velocity_mm_s == -20.0


@pytest.mark.parametrize("velocity_mm_s", [40.0, -40.0])
def test_braking_takes_speed_over_acceleration(velocity_mm_s: float):
    stop = braking(2.0, 10.0, velocity_mm_s, 400.0)
    assert stop == Phase(2.0, 2.1, 10.0, velocity_mm_s, -math.copysign(400.0, velocity_mm_s))
    assert stop.end_velocity_mm_s == pytest.approx(0.0)
