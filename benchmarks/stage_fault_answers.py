"""Stages of the fault campaign that have no wire: a program, and a person.

A program (`command`) is struck at its answers: what it prints is damaged, late or missing, it is
gone, it loses its place, or it claims what is not so; a person (`manual`) at what is typed.
"""

import json
import random
from collections.abc import Generator, Sequence
from contextlib import contextmanager

from rig_drivers.command.stage import CommandStage
from rig_drivers.manual.stage import ManualStage
from rig_sim.clock import VirtualClock
from rig_sim.wire.faults import (
    BrownOut,
    Delay,
    Drop,
    Duplicate,
    Fault,
    Garble,
    HangUp,
    Lie,
    Silence,
    Split,
    Trip,
)

from benchmarks.stage_fault_beds import Bed
from rig.devices import Clock
from rig.errors import DeviceLostError, DeviceNotFoundError
from rig.profile import CommandStageConfig, ManualStageConfig
from tests.support.programs import FakeCall, FakeProgram

COMMAND = CommandStageConfig(kind="command", command=("stage",), travel_mm=(110.0, 200.0))
MANUAL = ManualStageConfig(kind="manual", travel_mm=(110.0, 200.0), tolerance_mm=1.0)
EVER_S = 1e9
"""When a call that hangs answers."""
READING_MM = 0.3
"""How far from the asked place a hand puts the board."""


class FaultyProgram(FakeProgram):
    """A program whose answers are struck; keeps `rig_drivers.command.program.Program`."""

    def __init__(self, clock: Clock, fault: Fault) -> None:
        super().__init__(clock)
        self._fault = fault
        self._struck = 0
        self._is_mended = self._is_lost = False
        self._random = random.Random(fault.seed if isinstance(fault, Garble) else 0)  # noqa: S311
        self.in_motion: list[int] = []

    @property
    def has_struck(self) -> bool:
        """See `Striker`."""
        return self._struck > 0

    @property
    def passed(self) -> int:
        """See `Striker`."""
        return len(self.asked)

    def mend(self) -> None:
        """See `Striker`."""
        self._is_mended = True
        self._is_lost = False

    @property
    def goal_mm(self) -> float:
        """Where the move at work leads."""
        return self._to_mm

    @property
    def _is_due(self) -> bool:
        return len(self.asked) > self._fault.after_bytes and not self._is_mended

    def start(self, arguments: Sequence[str]) -> "FakeCall":
        """See `Program.start`."""
        if isinstance(self._fault, HangUp) and self._is_due:
            self._struck += 1
            raise DeviceNotFoundError("stage", "cannot run 'stage'", advice="check stage.command")
        super().start(arguments)
        if arguments[0] == "move":
            self.in_motion.append(len(self.asked) - 1)
        strikes = self._is_due and (isinstance(self._fault, Silence) or not self._struck)
        call = StruckCall(self, arguments[0], self._fault if strikes else None)
        if strikes and not isinstance(self._fault, Lie):
            self._strike()
        elif strikes and arguments[0] == "move":
            self._struck += 1
        return call

    def _strike(self) -> None:
        self._struck += 1
        if isinstance(self._fault, BrownOut | Trip):
            self._from_mm = self._to_mm = self.at_mm
            self._is_lost = isinstance(self._fault, BrownOut)

    def said(self, word: str) -> str:
        """See `FakeProgram`."""
        if self._is_lost and word != "stop":
            return json.dumps({"position_mm": None}) + "\n"
        return super().said(word)

    def spoiled(self, text: str) -> str:
        """Return an answer as the fault leaves it."""
        fault = self._fault
        if not isinstance(fault, Drop | Duplicate | Garble):
            return text
        at = self._random.randrange(len(text))
        part, rest = text[at : at + fault.count], text[at + fault.count :]
        match fault:
            case Drop():
                return text[:at] + rest
            case Duplicate():
                return text[:at] + part + part + rest
            case Garble():
                other = "".join(chr(self._random.randrange(32, 127)) for _ in part)
                return text[:at] + other + rest


class StruckCall(FakeCall):
    """One call of a program that may be struck."""

    def __init__(self, program: FaultyProgram, word: str, fault: Fault | None) -> None:
        super().__init__(program, word)
        self._faulty, self._fault = program, fault
        self._ready_s = program.clock.now_s() + _late_s(fault)

    def output(self, wait_s: float) -> tuple[int, str, str] | None:
        """See `Running.output`."""
        program, clock = self._faulty, self._faulty.clock
        if clock.now_s() < self._ready_s:
            clock.sleep_s(min(wait_s, self._ready_s - clock.now_s()))
            return None
        match self._fault:
            case None | Delay() | Split():
                return super().output(wait_s)
            case Lie() if self._word == "move":
                return 0, json.dumps({"position_mm": program.goal_mm}) + "\n", ""
            case Trip():
                return 1, json.dumps({"error": "a limit switch was hit"}) + "\n", ""
            case _:
                answer = super().output(wait_s)
                return None if answer is None else (0, program.spoiled(answer[1]), "")


def _late_s(fault: Fault | None) -> float:
    match fault:
        case Delay(duration_s=duration_s):
            return duration_s
        case Split(gap_s=gap_s):
            return 25.0 * gap_s  # so many characters, one by one
        case Silence():
            return EVER_S
        case _:
            return 0.0


@contextmanager
def command_bed(config: CommandStageConfig, fault: Fault) -> Generator[Bed]:
    """Give a stage behind a program whose answers are struck."""
    clock = VirtualClock(100.0)
    program = FaultyProgram(clock, fault)
    yield Bed(
        clock,
        CommandStage(config, clock, program),
        lambda: program.at_mm,
        lambda: program.is_moving,
        program,
    )


# -- a person -------------------------------------------------------------------------------------


class FaultyPerson:
    """Puts the board within 0.3 mm and types where it is; keeps `rig_drivers.manual.Person`."""

    def __init__(self, clock: Clock, fault: Fault) -> None:
        self._clock = clock
        self._fault = fault
        self._random = random.Random(f"{fault}")  # noqa: S311
        self._struck = 0
        self._is_mended = False
        self._ready_s = 0.0
        self.passed = 0
        self.in_motion: list[int] = []
        self.true_mm = 0.0

    @property
    def has_struck(self) -> bool:
        """See `Striker`."""
        return self._struck > 0

    def mend(self) -> None:
        """See `Striker`."""
        self._is_mended = True

    def greet(self) -> None:
        """See `Person.greet`."""

    def tell(self, text: str) -> None:
        """See `Person.tell`."""
        if text.startswith("Put the board at "):
            wanted_mm = float(text.split()[4])
            self.true_mm = round(wanted_mm + self._random.uniform(-0.3, 0.3), 1)
        takes_s = 2.0
        if self._strikes and isinstance(self._fault, Delay):
            self._struck += 1
            takes_s += 200.0 * self._fault.duration_s  # up to half an hour
        self._ready_s = self._clock.now_s() + takes_s

    @property
    def _strikes(self) -> bool:
        return self.passed > self._fault.after_bytes and not self._is_mended and not self._struck

    def answer(self, timeout_s: float) -> str | None:
        """See `Person.answer`."""
        has_left = isinstance(self._fault, Silence | HangUp) and (self._strikes or self._struck)
        if has_left and not self._is_mended:
            self._struck += 1
            if isinstance(self._fault, HangUp):
                raise DeviceLostError("stage", "the terminal is closed", advice="resume the run")
            self._clock.sleep_s(max(timeout_s, 1e-3))
            return None
        left_s = self._ready_s - self._clock.now_s()
        if left_s > timeout_s:
            self._clock.sleep_s(max(timeout_s, 1e-3))
            return None
        self._clock.sleep_s(max(0.0, left_s))
        self.passed += 1
        return self._typed(f"{self.true_mm:.1f}")

    def _typed(self, text: str) -> str:
        fault = self._fault
        if not self._strikes or not isinstance(fault, Drop | Duplicate | Garble):
            return text
        self._struck += 1
        at = self._random.randrange(len(text))
        part, rest = text[at : at + fault.count], text[at + fault.count :]
        match fault:
            case Drop():
                return text[:at] + rest
            case Duplicate():
                return text[:at] + part + part + rest
            case Garble():
                return (
                    text[:at] + "".join(self._random.choice("0123456789.,x") for _ in part) + rest
                )


@contextmanager
def manual_bed(config: ManualStageConfig, fault: Fault) -> Generator[Bed]:
    """Give a stage that is a person whose typing is struck."""
    clock = VirtualClock(100.0)
    person = FaultyPerson(clock, fault)
    yield Bed(
        clock,
        ManualStage(config, clock, person),
        lambda: person.true_mm,
        lambda: False,
        person,
    )
