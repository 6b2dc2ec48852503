"""The homing cycle (`$H`)."""

import math

from rig_sim.firmware.chip import Program
from rig_sim.firmware.grbl.machine import HOMING_NO_SWITCH, HOMING_PULL_OFF, Machine
from rig_sim.firmware.grbl.realtime import realtime
from rig_sim.firmware.grbl.report import State

SEARCH = 1.5
"""The first approach gives up after so many times the travel,"""
LOCATE = 5.0
"""the second after so many times the pull-off."""
SEARCH_IN_VAIN_S = 2.0
"""How long an axis without a switch is searched."""


def home(machine: Machine) -> Program:
    """Find the switch and set the machine coordinate; ends aborted if that fails.

    Nothing is heeded on the way but a reset; a `?` is answered at the end, once.
    """
    machine.state = State.HOMING
    machine.steppers.flush()
    settings, axis = machine.settings, machine.axis
    travel_mm, pull_off_mm = settings.max_travel_mm(axis), settings.values[27]
    seek_mm_s, locate_mm_s = settings.values[25] / 60.0, settings.values[24] / 60.0
    up = -1.0 if settings.homes_down(axis) else 1.0
    yield from _approach_and_leave(machine, up * SEARCH * travel_mm, seek_mm_s)
    yield from _approach_and_leave(machine, up * LOCATE * pull_off_mm, locate_mm_s)
    if not machine.flags.reset:
        switch_mm = -travel_mm if settings.homes_down(axis) else 0.0
        # FluidNC sets its mpos_mm, here 0, where the pull-off ends.
        at_mm = 0.0 if settings.dialect == "fluidnc" else switch_mm - up * pull_off_mm
        machine.steppers.set_counted(at_mm)
    yield from realtime(machine)
    if not machine.is_aborted:
        machine.state = State.IDLE


def find_no_switch(machine: Machine) -> Program:
    """Home an axis to which nothing is connected; the carriage does not move."""
    machine.state = State.HOMING
    yield from machine.sleep(SEARCH_IN_VAIN_S)
    _fail(machine, HOMING_NO_SWITCH)
    yield from realtime(machine)


def _approach_and_leave(machine: Machine, way_mm: float, speed_mm_s: float) -> Program:
    values = machine.settings.values
    machine.has_found_switch = False
    machine.is_approaching = True
    yield from _run(machine, way_mm, speed_mm_s)
    machine.is_approaching = False
    if not machine.has_found_switch:
        _fail(machine, HOMING_NO_SWITCH)
    # FluidNC backs off at its feed rate, GRBL at the speed of the search.
    back = 24 if machine.settings.dialect == "fluidnc" else 25
    yield from _run(machine, -math.copysign(values[27], way_mm), values[back] / 60.0)
    if machine.steppers.is_switch_closed:
        _fail(machine, HOMING_PULL_OFF)


def _run(machine: Machine, way_mm: float, speed_mm_s: float) -> Program:
    """Move, wait until at rest, and let the mechanics calm down."""
    if machine.flags.reset:
        return
    machine.steppers.seek(machine.now_s, way_mm, speed_mm_s)
    while machine.steppers.end_s is not None:
        yield
    machine.flags.motion_ended = False
    if not machine.flags.reset:
        yield from machine.sleep(machine.settings.values[26] * 1e-3)


def _fail(machine: Machine, code: int) -> None:
    """Raise the alarm, unless a reset has already stopped everything."""
    if not machine.flags.reset:
        machine.flags.alarm = code
        machine.reset()
