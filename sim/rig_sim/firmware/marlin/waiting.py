"""Waiting as Marlin does it: lines go on coming in, and the host is told that it lives."""

from collections.abc import Callable

from rig_sim.firmware.chip import Program
from rig_sim.firmware.marlin.machine import Machine


def wait(machine: Machine, is_done: Callable[[], bool], until_s: float | None = None) -> Program:
    """Wait, saying `busy` now and then.

    Args:
        machine: whose command is at work.
        is_done: whether the wait is over.
        until_s: when it will be, if only time counts.
    """
    busy_s = machine.now_s + machine.settings.keepalive_s
    while not is_done() and not machine.is_killed:
        machine.pull()
        if machine.now_s >= busy_s:
            machine.print("echo:busy: processing")
            busy_s = machine.now_s + machine.settings.keepalive_s
        machine.wake_s = busy_s if until_s is None else min(busy_s, until_s)
        yield
    machine.wake_s = None
