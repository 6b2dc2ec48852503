"""A stage's program without a process, on a virtual clock."""

import json
from collections.abc import Generator, Sequence
from contextlib import contextmanager

from rig_drivers.command.stage import CommandStage
from rig_sim.clock import VirtualClock

from rig.devices import Clock
from rig.profile import CommandStageConfig

SPEED_MM_S = 100.0


class FakeProgram:
    """Moves at constant speed; a `stop` ends the motion where it is."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.asked: list[tuple[str, ...]] = []
        self.says: dict[str, str] = {}
        """By subcommand: what it prints instead."""
        self.hangs: set[str] = set()
        self.killed = 0
        self.short_mm = 0.0
        """How much too near a move ends."""
        self._from_mm = self._to_mm = 400.0
        self._start_s = 0.0

    @property
    def at_mm(self) -> float:
        way_mm = self._to_mm - self._from_mm
        gone_mm = min(abs(way_mm), SPEED_MM_S * (self.clock.now_s() - self._start_s))
        return self._from_mm + (gone_mm if way_mm > 0.0 else -gone_mm)

    @property
    def is_moving(self) -> bool:
        return self.at_mm != self._to_mm

    def start(self, arguments: Sequence[str]) -> "FakeCall":
        word, *rest = arguments
        self.asked.append(tuple(arguments))
        if word == "stop":
            self._from_mm = self._to_mm = self.at_mm
        elif word == "move":
            self._from_mm = self.at_mm
            self._to_mm, self._start_s = float(rest[0]) - self.short_mm, self.clock.now_s()
        return FakeCall(self, word)

    def said(self, word: str) -> str:
        answer = {"stopped": True} if word == "stop" else {"position_mm": round(self.at_mm, 6)}
        return self.says.get(word, json.dumps(answer) + "\n")


class FakeCall:
    """One call at work."""

    def __init__(self, program: FakeProgram, word: str) -> None:
        self._program = program
        self._word = word

    def output(self, wait_s: float) -> tuple[int, str, str] | None:
        program, word = self._program, self._word
        if word in program.hangs or (word == "move" and program.is_moving):
            program.clock.sleep_s(wait_s)
            return None
        return 0, program.said(word), ""

    def kill(self) -> None:
        self._program.killed += 1


@contextmanager
def command_bench(
    **changes: object,
) -> Generator[tuple[CommandStage, FakeProgram, VirtualClock]]:
    """Give a stage that is not yet open, its program and their clock."""
    clock = VirtualClock(100.0)
    program = FakeProgram(clock)
    config = CommandStageConfig.model_validate(
        {"kind": "command", "command": ["stage"], "travel_mm": (400.0, 900.0), **changes}
    )
    yield CommandStage(config, clock, program), program, clock
