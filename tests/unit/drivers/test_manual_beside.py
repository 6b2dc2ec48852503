"""A person at the terminal and one at a page: whoever answers first has answered."""

from collections import deque

import pytest
from rig_drivers.manual.beside import Beside
from rig_drivers.manual.kind import MANUAL
from rig_drivers.manual.stage import ManualStage
from rig_sim.clock import VirtualClock

from rig.errors import DeviceNotFoundError, StageTimeoutError
from rig.profile import ManualStageConfig
from rig.profile.kinds import Surroundings
from tests.support.people import ScriptedPerson


class AtPage:
    """Answers at once from a list, or never."""

    def __init__(self, clock: VirtualClock, *answers: str) -> None:
        self._clock = clock
        self._answers = deque(answers)
        self.asked: list[str] = []
        self.settled = 0

    def ask(self, text: str) -> None:
        self.asked.append(text)

    def settle(self) -> None:
        self.settled += 1

    def answer(self, timeout_s: float) -> str | None:
        if self._answers:
            return self._answers.popleft()
        self._clock.sleep_s(timeout_s)
        return None


class Nobody(ScriptedPerson):
    """No terminal."""

    def greet(self) -> None:
        raise DeviceNotFoundError("stage", "asks a person at the terminal", advice="run it in one")

    def answer(self, timeout_s: float) -> str | None:
        raise AssertionError("nobody is there")


def stage_of(person: ScriptedPerson, page: AtPage, clock: VirtualClock) -> ManualStage:
    config = ManualStageConfig(kind="manual", travel_mm=(400.0, 900.0))
    return ManualStage(config, clock, Beside(person, page))


def test_the_page_answers_while_the_person_at_the_terminal_is_away():
    clock = VirtualClock(100.0)
    person = ScriptedPerson(clock, (), takes_s=1e6)
    page = AtPage(clock, "", "450.8")
    with stage_of(person, page, clock) as stage:
        stage.home()
        assert stage.move_to(450.0, 60.0) == 450.8
    assert page.asked == person.told
    assert [text[:25] for text in page.asked] == [
        "Put the board at 400.0 mm",
        "Put the board at 450.0 mm",
    ]
    assert page.settled == 2


def test_the_terminal_answers_as_ever():
    clock = VirtualClock(100.0)
    page = AtPage(clock)
    with stage_of(ScriptedPerson(clock, (), takes_s=2.0), page, clock) as stage:
        stage.home()
        assert stage.position_mm == 400.0
    assert page.settled == 1


def test_without_a_terminal_the_page_is_enough():
    clock = VirtualClock(100.0)
    page = AtPage(clock, "away", "")
    with stage_of(Nobody(clock, (), 0.0), page, clock) as stage:
        stage.home()
    assert page.asked[1] == "'away' is no distance in mm; Enter alone: it stands there."


def test_where_neither_answers_the_patience_ends():
    clock = VirtualClock(100.0)
    with (
        stage_of(Nobody(clock, (), 0.0), AtPage(clock), clock) as stage,
        pytest.raises(StageTimeoutError, match="nobody pressed Enter within 900 s"),
    ):
        stage.home()
    assert clock.now_s() == pytest.approx(1000.0)


def test_who_looks_on_comes_with_the_surroundings():
    clock = VirtualClock(100.0)
    page = AtPage(clock, "")
    config = ManualStageConfig(kind="manual", travel_mm=(400.0, 900.0))
    around = Surroundings("bench", (), clock, bystander=page)
    with MANUAL.open(config, around) as stage:  # standard input is no terminal here
        stage.home()
    assert page.settled == 1
