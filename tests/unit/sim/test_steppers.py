"""Planner and steppers by closed form: blocks, shares of the axes, switch, steps."""

import math

import pytest
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.steppers import PLANNER_BLOCKS, Steppers

from rig.profile import CarriageConfig


class Limits:
    """X is fine and slow, Y coarse and fast, Z between."""

    def max_rate_mm_s(self, axis: int) -> float:
        return (30.0, 100.0, 50.0)[axis]

    def acceleration_mm_s2(self, axis: int) -> float:
        return (100.0, 400.0, 300.0)[axis]

    def steps_per_mm(self, axis: int) -> float:
        return (100.0, 10.0, 50.0)[axis]


def steppers(**changes: float) -> tuple[Steppers, Carriage]:
    config = CarriageConfig.model_validate(
        {"board_at_machine_zero_mm": 500.0, "power_up_mm": -40.0, **changes}
    )
    carriage = Carriage(config, VirtualClock())
    return Steppers(Limits(), carriage, 0), carriage


def test_fifteen_blocks_are_planned():
    found, _ = steppers()
    assert PLANNER_BLOCKS == 15
    for number in range(1, 16):
        assert not found.is_full
        found.add((float(number), 0.0, 0.0), None)
        assert found.free_blocks == 15 - number
    assert found.is_full
    assert found.planned_mm == (15.0, 0.0, 0.0)
    found.flush()
    assert (found.has_blocks, found.free_blocks) == (False, 15)
    assert found.planned_mm == (0.0, 0.0, 0.0)


def test_a_block_is_rounded_to_steps_and_left_out_where_nothing_remains():
    found, _ = steppers()
    found.add((0.0049, 0.049, 0.0), 5.0)
    assert not found.has_blocks
    found.add((0.0051, 0.051, 0.011), 5.0)
    assert found.planned_mm == (0.01, 0.1, 0.02)
    found.add((0.012, 0.1, 0.02), 5.0)
    assert found.free_blocks == 14


@pytest.mark.parametrize(
    ("target_mm", "feed_mm_s", "time_s"),
    [
        ((30.0, 0.0, 0.0), None, 30.0 / 30.0 + 30.0 / 100.0),
        ((30.0, 0.0, 0.0), 10.0, 3.0 + 0.1),
        ((30.0, 0.0, 0.0), 99.0, 1.3),
        ((0.0, 100.0, 0.0), None, 1.0 + 0.25),
        # Along the diagonal of 3, 4, 0 each axis gives its share: X 30 / 0.6 = 50 mm/s and
        # 100 / 0.6 mm/s2 bind.
        ((30.0, 40.0, 0.0), None, 50.0 / 50.0 + 50.0 / (100.0 / 0.6)),
        ((0.0, 30.0, -40.0), None, 50.0 / 62.5 + 62.5 / 375.0),
        ((1.0, 0.0, 0.0), None, 2.0 * math.sqrt(1.0 / 100.0)),
        ((1.0, 0.0, 0.0), 0.0, 60.0 + 1.0 / 6000.0),
    ],
)
def test_a_block_takes_the_time_of_its_slowest_axis(
    target_mm: tuple[float, float, float], feed_mm_s: float | None, time_s: float
):
    found, _ = steppers()
    found.add(target_mm, feed_mm_s)
    found.begin(5.0)
    assert found.end_s == pytest.approx(5.0 + time_s)
    found.finish(5.0 + time_s)
    assert found.position_mm(99.0) == target_mm
    assert (found.has_blocks, found.end_s) == (False, None)


def test_on_the_way_all_axes_keep_their_share_in_whole_steps():
    found, carriage = steppers()
    found.add((30.0, 40.0, 0.0), 25.0)
    found.begin(0.0)
    # 25 mm/s after 0.15 s and 1.875 mm.
    assert found.speed_mm_s(0.06) == pytest.approx(10.0)
    assert found.speed_mm_s(1.0) == pytest.approx(25.0)
    way_mm = 1.875 + 25.0 * 0.85
    assert found.position_mm(1.0) == (round(60.0 * way_mm) / 100.0, round(8.0 * way_mm) / 10.0, 0.0)
    assert carriage.travelled_mm(1.0) == pytest.approx(-40.0 + 0.6 * way_mm)
    assert found.speed_mm_s(9.0) == pytest.approx(0.0, abs=1e-9)


def test_braking_comes_to_rest_and_the_rest_of_the_block_stays():
    found, carriage = steppers()
    found.add((30.0, 0.0, 0.0), 20.0)
    found.begin(0.0)
    found.brake(1.0)
    # 2 mm of ramp, 0.8 s at 20 mm/s, then 0.2 s and 2 mm of braking.
    assert found.end_s == pytest.approx(1.2)
    found.brake(1.1)
    assert found.end_s == pytest.approx(1.2), "it brakes already"
    found.finish(1.2)
    assert found.position_mm(5.0) == (20.0, 0.0, 0.0)
    assert carriage.travelled_mm(5.0) == pytest.approx(-20.0)
    assert found.has_blocks
    found.begin(6.0)
    assert found.end_s == pytest.approx(6.0 + 10.0 / 20.0 + 0.2)


def test_braking_where_the_motion_ends_anyway_changes_nothing():
    found, carriage = steppers()
    found.add((30.0, 0.0, 0.0), 20.0)
    found.begin(0.0)
    end_s = 30.0 / 20.0 + 0.2
    found.brake(end_s - 0.1)
    assert found.end_s == pytest.approx(end_s)
    found.finish(end_s)
    assert not found.has_blocks
    assert carriage.travelled_mm(9.0) == pytest.approx(-10.0)


def test_a_search_ends_where_the_switch_closes():
    found, carriage = steppers()
    assert not found.is_switch_closed
    found.seek(0.0, 60.0, 20.0)
    # The switch is 40 mm away: 2 mm of ramp take 0.2 s, 38 mm take 1.9 s.
    assert found.switch_s == pytest.approx(2.1)
    found.kill(2.1, slips=False)
    assert found.position_mm(9.0) == (40.0, 0.0, 0.0)
    assert found.is_switch_closed
    assert carriage.travelled_mm(9.0) == pytest.approx(0.0, abs=1e-9)
    found.set_counted(-2.0)
    assert found.position_mm(9.0) == (-2.0, 0.0, 0.0)
    found.seek(3.0, -5.0, 20.0)
    assert found.switch_s is None, "away from it"
    found.finish(9.0)
    assert found.position_mm(9.0) == (-7.0, 0.0, 0.0)
    assert carriage.travelled_mm(9.0) == pytest.approx(-5.0)
    assert not found.is_switch_closed


def test_other_axes_and_a_broken_switch_close_nothing():
    found, _ = steppers()
    found.add((0.0, 90.0, 0.0), None)
    found.begin(0.0)
    assert found.switch_s is None
    config = CarriageConfig(board_at_machine_zero_mm=500.0, power_up_mm=-40.0, has_switch=False)
    broken = Steppers(Limits(), Carriage(config, VirtualClock()), 0)
    broken.seek(0.0, 60.0, 20.0)
    assert broken.switch_s is None
    broken.finish(9.0)
    assert not broken.is_switch_closed


def test_a_power_up_forgets_the_count_and_not_the_place():
    found, carriage = steppers()
    found.add((30.0, 20.0, 0.0), None)
    found.begin(0.0)
    found.finish(9.0)
    found.forget()
    assert found.position_mm(9.0) == (0.0, 0.0, 0.0)
    found.add((5.0, 0.0, 0.0), None)
    found.begin(10.0)
    found.finish(19.0)
    assert carriage.travelled_mm(20.0) == pytest.approx(-5.0)


def test_a_coordinate_may_count_away_from_the_switch():
    config = CarriageConfig(board_at_machine_zero_mm=500.0, power_up_mm=-40.0)
    carriage = Carriage(config, VirtualClock())
    found = Steppers(Limits(), carriage, 0, toward_switch=-1)
    found.seek(0.0, -60.0, 20.0)
    assert found.switch_s == pytest.approx(2.1)
    found.kill(2.1, slips=False)
    found.set_counted(0.0)
    found.add((12.0, 0.0, 0.0), None)
    found.begin(3.0)
    found.finish(9.0)
    assert carriage.travelled_mm(9.0) == pytest.approx(-12.0)
    found.forget()
    found.add((1.0, 0.0, 0.0), None)
    found.begin(10.0)
    found.finish(19.0)
    assert carriage.travelled_mm(20.0) == pytest.approx(-13.0)
