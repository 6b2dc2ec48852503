"""A person who puts boards somewhere, on a virtual clock."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager

from rig_drivers.manual.stage import ManualStage
from rig_sim.clock import VirtualClock

from rig.devices import Clock
from rig.profile import ManualStageConfig


class ScriptedPerson:
    """Takes a while, then types the next answer; Enter alone when none is left."""

    def __init__(self, clock: Clock, answers: Sequence[str], takes_s: float) -> None:
        self._clock = clock
        self._answers = list(answers)
        self.takes_s = takes_s
        self.slow_to, self.slowly_s = "nowhere", takes_s
        self.told: list[str] = []
        self.on_wait: Callable[[], None] = lambda: None
        self._ready_s = 0.0

    def greet(self) -> None:
        """Is always there."""

    def tell(self, text: str) -> None:
        self.told.append(text)
        takes_s = self.slowly_s if self.slow_to in text else self.takes_s
        self._ready_s = self._clock.now_s() + takes_s

    def answer(self, timeout_s: float) -> str | None:
        self.on_wait()
        left_s = self._ready_s - self._clock.now_s()
        if left_s > timeout_s:
            self._clock.sleep_s(max(timeout_s, 1e-3))
            return None
        self._clock.sleep_s(left_s)
        return self._answers.pop(0) if self._answers else ""


@contextmanager
def manual_bench(
    *answers: str, takes_s: float = 2.0, **changes: object
) -> Generator[tuple[ManualStage, ScriptedPerson, VirtualClock]]:
    """Give a stage that is not yet open, its person and their clock."""
    clock = VirtualClock(100.0)
    person = ScriptedPerson(clock, answers, takes_s)
    config = ManualStageConfig.model_validate(
        {"kind": "manual", "travel_mm": (400.0, 900.0), **changes}
    )
    yield ManualStage(config, clock, person), person, clock
