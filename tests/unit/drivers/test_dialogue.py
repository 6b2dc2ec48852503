"""A dialogue on a line that says what it is told to say, when."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from rig_drivers.stage.dialogue import QUIET_S, SLICE_S, Dialogue, Noise

from rig.errors import StageAlarmError


@dataclass
class ScriptedClock:
    """Time that passes only while somebody waits."""

    at_s: float = 100.0

    def now_s(self) -> float:
        return self.at_s

    def sleep(self, duration_s: float) -> None:
        self.at_s += duration_s


@dataclass
class ScriptedLine:
    """Lines by the time at which they arrive."""

    clock: ScriptedClock
    arrivals: list[tuple[float, str]]
    noise_bytes: int = 0
    written: list[bytes] = field(default_factory=list[bytes])
    waits_s: list[float] = field(default_factory=list[float])

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def read_line(self, timeout_s: float) -> str | None:
        self.waits_s.append(timeout_s)
        if self.arrivals and self.arrivals[0][0] <= self.clock.at_s + max(timeout_s, 0.0):
            at_s, text = self.arrivals.pop(0)
            self.clock.at_s = max(self.clock.at_s, at_s)
            return text
        self.clock.at_s += max(timeout_s, 0.0)
        return None


@dataclass
class Bench:
    line: ScriptedLine
    dialogue: Any
    noticed: list[object]


def bench(*arrivals: tuple[float, str], refuse: Callable[[object], None] | None = None) -> Bench:
    line = ScriptedLine(ScriptedClock(), list(arrivals))
    noticed: list[object] = []

    def parse(text: str) -> object:
        return Noise(text) if text.startswith("?") else text

    made: Any = Dialogue
    dialogue = made(
        line, line.clock, "stage", parse=parse, notice=noticed.append,
        refuse=refuse or (lambda _: None),
    )  # fmt: skip
    return Bench(line, dialogue, noticed)


def test_the_next_reply_is_waited_for_until_the_deadline():
    here = bench((100.4, "ok"))
    assert here.dialogue.next(100.3) is None
    assert here.line.waits_s == [pytest.approx(0.3)]
    assert here.dialogue.next(100.5) == "ok"
    assert here.noticed == ["ok"]


def test_heeding_looks_for_a_cancel_in_slices():
    here = bench()
    assert here.dialogue.heed(100.0 + 2.5 * SLICE_S) is None
    assert here.line.waits_s[:3] == pytest.approx([SLICE_S, SLICE_S, 0.5 * SLICE_S])
    assert here.line.clock.at_s == pytest.approx(100.0 + 2.5 * SLICE_S)


def test_what_was_cancelled_gives_up_and_nothing_begins_until_it_may():
    here = bench((100.0, "ok"))
    here.dialogue.begin()
    here.dialogue.cancel()
    for attempt in (here.dialogue.check_cancelled, here.dialogue.begin, here.dialogue.heed_past):
        with pytest.raises(StageAlarmError, match="stopped on request") as stopped:
            attempt()
        assert stopped.value.code == "stopped"
    here.dialogue.resume()
    here.dialogue.begin()
    here.dialogue.check_cancelled()


def test_what_began_before_a_cancel_gives_up_also_after_others_may_begin():
    here = bench()
    here.dialogue.begin()
    here.dialogue.cancel()
    here.dialogue.resume()
    with pytest.raises(StageAlarmError, match="stopped on request"):
        here.dialogue.heed(101.0)
    here.dialogue.restart()
    assert here.dialogue.heed(100.1) is None


def test_what_nobody_asked_for_is_refused_but_only_where_it_is_heeded():
    def refuse(reply: object) -> None:
        if reply == "ALARM":
            raise StageAlarmError("stage", "alarm", advice="home", code="alarm")

    here = bench((100.0, "ALARM"), (100.0, "ALARM"), (100.0, "ok"), (100.0, "ALARM"), refuse=refuse)
    assert here.dialogue.next(100.0) == "ALARM"
    with pytest.raises(StageAlarmError, match="alarm"):
        here.dialogue.heed(100.0)
    with pytest.raises(StageAlarmError, match="alarm"):
        here.dialogue.heed_past()
    assert here.noticed == ["ALARM", "ALARM", "ok", "ALARM"]


def test_a_line_is_drained_until_it_is_quiet():
    late = 100.0 + 1.9 * QUIET_S
    here = bench((100.0, "a"), (100.0 + 0.95 * QUIET_S, "b"), (late + QUIET_S, "c"))
    here.dialogue.drain()
    assert here.noticed == ["a", "b"]
    assert here.line.waits_s == pytest.approx([QUIET_S] * 3)


def test_nonsense_is_counted_and_told():
    here = bench((100.0, "?x"), (100.0, "ok"), (100.0, "?y"))
    assert here.dialogue.noise_note() == ""
    for _ in range(3):
        here.dialogue.next(100.0)
    assert here.dialogue.noise_note() == " (2 damaged lines, 0 loose bytes came)"
    here.line.noise_bytes = 7
    assert here.dialogue.noise_note() == " (2 damaged lines, 7 loose bytes came)"
    here.dialogue.restart()
    assert here.dialogue.noise_note() == " (0 damaged lines, 7 loose bytes came)"
    here.dialogue.write(b"G0")
    assert here.line.written == [b"G0"]
