"""What GRBL does at every point where it looks at its flags: alarms, reports, holds, resets."""

from rig_sim.firmware.chip import Program
from rig_sim.firmware.grbl.machine import HARD_LIMIT, SOFT_LIMIT, Machine
from rig_sim.firmware.grbl.report import State

ALARM_PAUSE_S = 0.5
"""GRBL stands still after an alarm, so that the message gets out."""


def realtime(machine: Machine) -> Program:
    """Look at the flags, and stay while motion is suspended."""
    yield from _handle_flags(machine)
    while machine.is_suspended and not machine.is_aborted:
        yield
        yield from _handle_flags(machine)


def auto_start(machine: Machine) -> None:
    """Start queued motions, as GRBL does when no more lines are waiting."""
    if machine.steppers.has_blocks:
        machine.flags.start = True


def _handle_flags(machine: Machine) -> Program:
    flags = machine.flags
    if flags.alarm:
        yield from _handle_alarm(machine)
    if flags.reset:
        machine.is_aborted = True
        return
    if flags.status:
        flags.status = False
        machine.print(machine.reports.line(machine.snapshot()))
    if flags.hold or flags.cancel:
        _handle_hold(machine)
    elif flags.start:
        _handle_start(machine)
    flags.hold = flags.cancel = flags.start = False
    if flags.motion_ended:
        flags.motion_ended = False
        _handle_end(machine)


def _handle_alarm(machine: Machine) -> Program:
    """Tell the alarm; after a limit nothing but a reset is heeded."""
    flags = machine.flags
    machine.state = State.ALARM
    machine.print(f"ALARM:{flags.alarm}")
    yield from machine.sleep(ALARM_PAUSE_S)
    if flags.alarm in {HARD_LIMIT, SOFT_LIMIT}:
        machine.print("[MSG:Reset to continue]")
        flags.reset = False
        while not flags.reset:
            yield
    flags.alarm = 0


def _handle_hold(machine: Machine) -> None:
    """Brake; a jog is cancelled by it, anything else is held."""
    if machine.state in {State.ALARM, State.SLEEP}:
        return
    if machine.state in {State.CYCLE, State.JOG}:
        machine.steppers.brake(machine.now_s)
        machine.is_stopping = True
        machine.is_suspended = machine.state is State.JOG
    elif machine.state is State.IDLE:
        machine.is_suspended = True
    if machine.flags.hold and machine.state is not State.JOG:
        machine.state = State.HOLD


def _handle_start(machine: Machine) -> None:
    """Run queued motions, from rest or after a complete hold."""
    is_held = machine.state is State.HOLD and machine.is_suspended
    if machine.state is not State.IDLE and not is_held:
        return
    machine.is_suspended = machine.is_stopping = False
    if machine.steppers.has_blocks:
        machine.state = State.CYCLE
        machine.steppers.begin(machine.now_s)
    else:
        machine.state = State.IDLE


def _handle_end(machine: Machine) -> None:
    """A hold is complete, a jog is cancelled, or all motions are done."""
    if machine.state is State.HOLD and not machine.is_over_limit:
        machine.is_suspended = True
        return
    if machine.state is State.JOG and machine.is_stopping:
        machine.steppers.flush()
    machine.is_suspended = machine.is_stopping = False
    machine.state = State.IDLE
