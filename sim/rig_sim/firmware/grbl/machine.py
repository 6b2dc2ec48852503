"""The state of the simulated GRBL, and the interrupts that change it."""

from collections import deque
from dataclasses import dataclass

from rig.profile import FirmwareConfig
from rig_sim.carriage import Carriage
from rig_sim.firmware.axes import AXES
from rig_sim.firmware.chip import Program
from rig_sim.firmware.grbl.gcode import Modes
from rig_sim.firmware.grbl.report import Snapshot, State, StatusReports
from rig_sim.firmware.grbl.settings import GrblSettings
from rig_sim.firmware.steppers import Steppers

RECEIVE_BYTES = 128

HARD_LIMIT = 1
SOFT_LIMIT = 2
ABORT_CYCLE = 3
HOMING_RESET = 6
HOMING_PULL_OFF = 8
HOMING_NO_SWITCH = 9


@dataclass(slots=True)
class Flags:
    """What interrupts leave for the program."""

    reset: bool = False
    status: bool = False
    start: bool = False
    hold: bool = False
    cancel: bool = False
    motion_ended: bool = False
    alarm: int = 0


class Machine:
    """Everything that the parts of the firmware share.

    Interrupts act at once, at the time `now_s`; all else is up to the program.
    """

    def __init__(self, config: FirmwareConfig, carriage: Carriage, now_s: float) -> None:
        self.now_s = now_s
        self.axis = AXES.index(config.axis)
        self.settings = GrblSettings.of(config)
        self.steppers = Steppers(self.settings, carriage, self.axis)
        self.printed = bytearray()
        self.power_up()

    def power_up(self) -> None:
        """See `Chip.power_up`; the position is unknown, and locked if there is a switch to find."""
        self.steppers.kill(self.now_s, slips=True)
        self._lies = 0
        self.wake_s: float | None = None
        self.is_booting = True
        self.state = State.ALARM if self.settings.homing else State.IDLE
        self.steppers.forget()
        self.printed.clear()
        self.clear()

    def clear(self) -> None:
        """Forget what a reset forgets; machine state and position stay."""
        self.flags = Flags()
        self.received: deque[int] = deque()
        self.modes = Modes()
        self.reports = StatusReports(self.settings)
        self.steppers.flush()
        self.is_aborted = False
        self.is_suspended = False
        self.is_stopping = False
        self.is_over_limit = False
        self.is_approaching = False
        self.has_found_switch = False

    def print(self, *lines: str) -> None:
        """Put lines on the wire."""
        for line in lines:
            self.printed += line.encode() + b"\r\n"

    def sleep(self, duration_s: float) -> Program:
        """Do nothing at all, not even look at flags."""
        until_s = self.now_s + duration_s
        while self.now_s < until_s:
            self.wake_s = until_s
            yield

    def snapshot(self) -> Snapshot:
        """Return what a status report tells now."""
        steppers = self.steppers
        is_pressed = steppers.end_s is None and steppers.is_switch_closed
        is_lying = self._lies > 0
        self._lies = max(0, self._lies - 1)
        return Snapshot(
            state=State.IDLE if is_lying else self.state,
            is_held=self.is_suspended,
            position_mm=steppers.planned_mm if is_lying else steppers.position_mm(self.now_s),
            offset_mm=self.modes.offset_mm,
            speed_mm_s=steppers.speed_mm_s(self.now_s),
            free_blocks=steppers.free_blocks,
            free_bytes=RECEIVE_BYTES - len(self.received),
            switch=AXES[self.axis] if is_pressed else "",
        )

    # -- interrupts ---------------------------------------------------------------------------

    def next_event_s(self) -> float | None:
        """Return when the next interrupt comes by itself; None if none does."""
        switch_s = self.steppers.switch_s if self._watches_switch else None
        times_s = (self.wake_s, self.steppers.end_s, switch_s)
        return min((t for t in times_s if t is not None), default=None)

    def take_byte(self, byte: int) -> None:
        """Take one received byte; realtime commands never enter the line."""
        if byte == 0x18:
            self.reset()
        elif byte == ord("?"):
            self.flags.status = True
        elif byte == ord("~"):
            self.flags.start = True
        elif byte == ord("!"):
            self.flags.hold = True
        elif byte == 0x85:
            self.flags.cancel = self.flags.cancel or self.state is State.JOG
        elif byte < 0x80 and len(self.received) < RECEIVE_BYTES:
            self.received.append(byte)

    def take_event(self) -> None:
        """Let happen what is due: a timer, the switch, or the end of a motion."""
        steppers = self.steppers
        if _is_due(self.wake_s, self.now_s):
            self.wake_s = None
        if self._watches_switch and _is_due(steppers.switch_s, self.now_s):
            if self.state is State.HOMING:
                steppers.kill(self.now_s, slips=False)
                self.has_found_switch = True
            else:
                self.reset()
                self.flags.alarm = HARD_LIMIT
        elif _is_due(steppers.end_s, self.now_s):
            steppers.finish(self.now_s)
            is_running = self.state in {State.CYCLE, State.JOG} and not self.is_stopping
            if is_running and steppers.has_blocks:
                steppers.begin(self.now_s)
            else:
                self.flags.motion_ended = True

    def reset(self) -> None:
        """Ask for a reset; in motion this kills the steppers, and the position is lost."""
        if self.flags.reset:
            return
        self.flags.reset = True
        is_homing = self.state is State.HOMING
        if is_homing or self.steppers.end_s is not None:
            self.flags.alarm = self.flags.alarm or (HOMING_RESET if is_homing else ABORT_CYCLE)
            self.steppers.kill(self.now_s, slips=True)

    def trip(self) -> None:
        """See `Chip.trip`: noise on the wire of a limit switch; a hard limit."""
        self.reset()
        self.flags.alarm = HARD_LIMIT

    def lie(self, reports: int) -> None:
        """See `Chip.lie`."""
        self._lies = reports

    @property
    def is_asleep(self) -> bool:
        """Whether the motors have no current until the next reset."""
        return self.state is State.SLEEP

    @property
    def _watches_switch(self) -> bool:
        if self.state is State.HOMING:
            return self.is_approaching
        return self.settings.hard_limits and self.state is not State.ALARM


def _is_due(event_s: float | None, now_s: float) -> bool:
    return event_s is not None and event_s <= now_s
