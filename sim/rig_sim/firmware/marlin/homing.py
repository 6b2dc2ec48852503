"""The homing cycle (`G28`)."""

from collections.abc import Sequence

from rig_sim.firmware.axes import AXES, Vector
from rig_sim.firmware.chip import Program
from rig_sim.firmware.marlin.machine import Machine
from rig_sim.firmware.marlin.waiting import wait

SEARCH = 1.5
"""The first approach gives up after so many times the travel."""


def home(machine: Machine, axes: Sequence[str]) -> Program:
    """Find the switch of the carried axis at coordinate 0; other axes are there at once.

    A quick stop ends one approach only; without a switch found the controller kills itself.
    """
    yield from wait(machine, lambda: not machine.steppers.has_blocks)
    carried = AXES[machine.axis]
    if carried in axes and not machine.is_killed:
        config = machine.config
        way_mm = SEARCH * config.travel_mm
        yield from _approach(machine, way_mm, config.homing_mm_s)
        if not machine.is_killed:
            machine.steppers.seek(machine.now_s, config.pull_off_mm, config.homing_mm_s)
            yield from wait(machine, lambda: machine.steppers.end_s is None)
        if not machine.is_killed:
            yield from _approach(machine, 2.0 * config.pull_off_mm, config.homing_locate_mm_s)
        if machine.is_killed:
            return
        machine.steppers.set_counted(0.0)
    at: list[float] = [
        0.0 if axis in axes else value for axis, value in zip(AXES, machine.planned_mm, strict=True)
    ]
    machine.planned_mm = _vector(at)
    machine.homed |= set(axes)
    machine.print(position_of_home(machine.planned_mm))


def position_of_home(at_mm: Vector) -> str:
    """Return the line that ends homing."""
    return " ".join(f"{axis}:{value:.2f}" for axis, value in zip(AXES, at_mm, strict=True)) + (
        " E:0.00 Count X:0 Y:0 Z:0"
    )


def _approach(machine: Machine, way_mm: float, rate_mm_s: float) -> Program:
    if machine.is_killed:
        return
    machine.has_found_switch = False
    machine.is_approaching = True
    machine.steppers.seek(machine.now_s, -way_mm, rate_mm_s)
    yield from wait(machine, lambda: machine.steppers.end_s is None)
    machine.is_approaching = False
    if not machine.has_found_switch:
        machine.kill()


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = values
    return x, y, z
