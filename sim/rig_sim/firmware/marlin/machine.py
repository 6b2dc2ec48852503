"""The state of the simulated Marlin, and the interrupts that change it."""

import re
from collections import deque

from rig.profile import FirmwareConfig
from rig_sim.carriage import Carriage
from rig_sim.firmware.axes import AXES, Vector
from rig_sim.firmware.marlin.lines import Damaged, check_line
from rig_sim.firmware.marlin.settings import MarlinSettings
from rig_sim.firmware.steppers import Steppers

RECEIVE_BYTES = 128
QUEUE_LINES = 4
LINE_CHARACTERS = 95
_URGENT = re.compile(r" *(?:N[-0-9 ]*)?M(112|410)")
KILLED = "Error:Printer halted. kill() called!"


class Machine:
    """Everything that the parts of the firmware share; keeps `rig_sim.firmware.chip.Chip`."""

    def __init__(self, config: FirmwareConfig, carriage: Carriage, now_s: float) -> None:
        self.now_s = now_s
        self.config = config
        self.axis = AXES.index(config.axis)
        self.settings = MarlinSettings.of(config)
        self.steppers = Steppers(self.settings, carriage, self.axis, toward_switch=-1)
        self.printed = bytearray()
        self.power_up()

    def power_up(self) -> None:
        """See `Chip.power_up`."""
        self.steppers.kill(self.now_s, slips=True)
        self.steppers.forget()
        for name in MarlinSettings.__slots__:  # `settings` is shared with the steppers
            setattr(self.settings, name, getattr(MarlinSettings.of(self.config), name))
        self.printed.clear()
        self.wake_s: float | None = None
        self.is_booting = True
        self.is_killed = False
        self.is_incremental = False
        self.is_approaching = False
        self.has_found_switch = False
        self.lies = 0
        self.feed_mm_s = 25.0
        self.planned_mm: Vector = (0.0, 0.0, 0.0)
        self.homed: set[str] = set()
        self.last_number = 0
        self.queue: deque[tuple[str, int | None]] = deque()
        self._received: deque[int] = deque()
        self._line = ""
        self._urgent = ""

    def print(self, *lines: str) -> None:
        """Put lines on the wire."""
        for line in lines:
            self.printed += line.encode() + b"\n"

    # -- interrupts ---------------------------------------------------------------------------

    def next_event_s(self) -> float | None:
        """See `Chip.next_event_s`."""
        switch_s = self.steppers.switch_s if self.is_approaching else None
        times_s = (self.wake_s, self.steppers.end_s, switch_s)
        return min((t for t in times_s if t is not None), default=None)

    def take_byte(self, byte: int) -> None:
        """See `Chip.take_byte`; the emergency parser looks at bytes before anybody else."""
        if chr(byte) in "\r\n":
            found = _URGENT.match(self._urgent)
            if found is not None and self.settings.emergency_parser:
                self.heed(found[1])
            self._urgent = ""
        else:
            self._urgent += chr(byte) if len(self._urgent) < LINE_CHARACTERS else ""
        if len(self._received) < RECEIVE_BYTES:
            self._received.append(byte)

    def take_event(self) -> None:
        """See `Chip.take_event`."""
        steppers = self.steppers
        if _is_due(self.wake_s, self.now_s):
            self.wake_s = None
        if self.is_approaching and _is_due(steppers.switch_s, self.now_s):
            steppers.kill(self.now_s, slips=False)
            self.has_found_switch = True
            self.is_approaching = False
        elif _is_due(steppers.end_s, self.now_s):
            steppers.finish(self.now_s)
            if steppers.has_blocks:
                steppers.begin(self.now_s)

    def trip(self) -> None:
        """See `Chip.trip`: a heater that nobody uses runs away."""
        self.print("Error:Thermal Runaway, system stopped! Heater_ID: bed")
        self.kill()

    def lie(self, reports: int) -> None:
        """See `Chip.lie`: the next waits for the end of motion do not wait."""
        self.lies = reports

    def heed(self, code: str) -> None:
        """Carry out an urgent command."""
        if code == "112":
            self.kill()
        elif not self.is_killed:
            self.quick_stop()

    def kill(self) -> None:
        """Halt for good; the motors lose their current."""
        if not self.is_killed:
            self.is_killed = True
            self.steppers.kill(self.now_s, slips=True)
            self.steppers.flush()
            self.print(KILLED)

    def quick_stop(self) -> None:
        """Stop dead and go on from where the steppers have counted."""
        self.steppers.kill(self.now_s, slips=True)
        self.steppers.flush()
        self.planned_mm = self.steppers.position_mm(self.now_s)

    # -- lines --------------------------------------------------------------------------------

    def pull(self) -> None:
        """Take lines from what was received, as long as the queue has room."""
        while self._received and len(self.queue) < QUEUE_LINES and not self.is_killed:
            character = chr(self._received.popleft())
            if character not in "\r\n":
                self._line += character if len(self._line) < LINE_CHARACTERS else ""
                continue
            line, self._line = self._line.partition(";")[0], ""
            if line.strip():
                self._take_line(line)

    def _take_line(self, line: str) -> None:
        taken = check_line(line, self.last_number)
        if isinstance(taken, Damaged):
            self._received.clear()
            self.print(
                f"Error:{taken.error}, Last Line: {self.last_number}",
                f"Resend: {self.last_number + 1}",
                "ok",
            )
            return
        if taken.number is not None:
            self.last_number = taken.number
        urgent = _URGENT.match(taken.text)
        if urgent is not None and taken.number is None and not self.settings.emergency_parser:
            self.heed(urgent[1])
        self.queue.append((taken.text, taken.number))


def _is_due(event_s: float | None, now_s: float) -> bool:
    return event_s is not None and event_s <= now_s
