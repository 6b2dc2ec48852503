"""The stage that is a person: what is asked, what is taken for an answer, and a real terminal."""

import os
import threading
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.manual.stage import ManualStage, read_mm
from rig_drivers.manual.terminal import Terminal
from rig_sim.clock import VirtualClock

from rig.devices import SystemClock
from rig.errors import (
    ConfigError,
    DeviceLostError,
    DeviceNotFoundError,
    StageAlarmError,
    StageLimitError,
    StageTimeoutError,
)
from rig.profile import ManualStageConfig
from tests.support.people import ScriptedPerson, manual_bench


@pytest.mark.parametrize(
    ("typed", "reading_mm"),
    [
        ("400", 400.0),
        ("400.5", 400.5),
        ("400,5", 400.5),
        ("400.5 mm", 400.5),
        ("400mm", 400.0),
        ("", None),
        ("40 cm", None),
        ("-400", None),
        ("4e2", None),
        ("1234567", None),
        ("there", None),
    ],
)
def test_a_reading_is_a_distance_in_mm(typed: str, reading_mm: float | None) -> None:
    assert read_mm(typed) == reading_mm


@given(st.text(max_size=30))
def test_any_text_is_a_reading_or_none(typed: str) -> None:
    reading_mm = read_mm(typed)
    assert reading_mm is None or 0.0 <= reading_mm < 1e6


def test_enter_means_that_it_stands_there() -> None:
    with manual_bench() as (stage, person, _), stage:
        stage.home()
        assert stage.position_mm == 400.0
        assert stage.move_to(450.0, 60.0) == stage.position_mm == 450.0
    assert [text[:26] for text in person.told] == [
        "Put the board at 400.0 mm ",
        "Put the board at 450.0 mm ",
    ]


def test_a_typed_reading_is_where_it_stands() -> None:
    with manual_bench("", "450,8 mm") as (stage, _, _clock), stage:
        stage.home()
        assert stage.move_to(450.0, 60.0) == stage.position_mm == 450.8


def test_what_is_no_reading_is_asked_for_again() -> None:
    with manual_bench("", "what?", "455.1", "444.9", "455.0") as (stage, person, _), stage:
        stage.home()
        assert stage.move_to(450.0, 60.0) == 455.0
    assert "'what?' is no distance in mm" in person.told[2]
    assert "455.1 mm is more than 5.0 mm away from 450.0 mm" in person.told[3]
    assert "444.9 mm is more than 5.0 mm away" in person.told[4]


def test_nobody_is_asked_to_put_it_where_it_stands() -> None:
    with manual_bench() as (stage, person, _), stage:
        stage.home()
        person.told.clear()
        assert stage.move_to(400.0, 60.0) == 400.0
        assert person.told == []


def test_the_person_has_the_patience_of_the_profile() -> None:
    with manual_bench(takes_s=899.0, patience_s=900.0) as (stage, _, clock), stage:
        stage.home()
        start_s = clock.now_s()
        assert stage.move_to(450.0, 1.0) == 450.0
        assert clock.now_s() - start_s == pytest.approx(899.0, abs=0.5)


@pytest.mark.parametrize(("patience_s", "timeout_s"), [(30.0, 10.0), (10.0, 30.0)])
def test_who_does_not_come_is_told(patience_s: float, timeout_s: float) -> None:
    with manual_bench(patience_s=patience_s) as (stage, person, clock), stage:
        stage.home()
        person.takes_s = 1e6
        start_s = clock.now_s()
        with pytest.raises(StageTimeoutError, match="nobody pressed Enter within 30 s"):
            stage.move_to(450.0, timeout_s)
        assert clock.now_s() - start_s == pytest.approx(30.0, abs=0.5)
        with pytest.raises(StageAlarmError, match="nearest distance") as caught:
            _ = stage.position_mm
        assert caught.value.code == "not homed"


def test_a_stop_while_waiting_costs_the_position() -> None:
    with manual_bench() as (stage, person, _), stage:
        stage.home()
        person.on_wait = stage.stop
        with pytest.raises(StageAlarmError, match="nobody knows where the board is") as caught:
            stage.move_to(450.0, 60.0)
        assert caught.value.code == "stopped"
        person.on_wait = lambda: None
        stage.stop()
        stage.home()
        assert stage.position_mm == 400.0


def test_outside_the_travel_nobody_is_asked() -> None:
    with manual_bench() as (stage, person, _), stage:
        stage.home()
        person.told.clear()
        with pytest.raises(StageLimitError):
            stage.move_to(399.9, 60.0)
        assert person.told == []


def test_moving_may_be_forbidden() -> None:
    with manual_bench(may_move=False) as (stage, person, _), stage:
        for move in (stage.home, lambda: stage.move_to(450.0, 1.0)):
            with pytest.raises(ConfigError, match="may_move is false"):
                move()
    assert person.told == []


def test_the_sigma_of_a_reading_belongs_to_its_identity_and_distances() -> None:
    with manual_bench(reading_sigma_mm=0.25) as (stage, _, _clock), stage:
        assert stage.identity == {"kind": "manual", "reading": "1 sigma 0.25 mm"}
    config = ManualStageConfig(kind="manual", travel_mm=(1.0, 2.0), reading_sigma_mm=0.25)
    assert config.distance_sigma_mm == 0.25


# -- a real terminal ------------------------------------------------------------------------------


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The other end of a pseudo-terminal that is standard input."""
    keys, screen = os.openpty()
    with os.fdopen(screen, "r") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        yield keys
    os.close(keys)


def test_enter_at_a_real_terminal_is_heard(
    keyboard: int, capsys: pytest.CaptureFixture[str]
) -> None:
    config = ManualStageConfig(kind="manual", travel_mm=(400.0, 900.0))
    typist = threading.Thread(target=lambda: os.write(keyboard, b"\n450.25\n"))
    with ManualStage(config, SystemClock(), Terminal("stage")) as stage:
        typist.start()
        stage.home()
        assert stage.move_to(450.0, 60.0) == 450.25
    typist.join()
    said = capsys.readouterr()
    assert said.out == ""
    assert "Put the board at 450.0 mm and press Enter" in said.err


def test_a_line_that_is_not_ended_is_no_answer(keyboard: int) -> None:
    terminal = Terminal("stage")
    terminal.greet()
    os.write(keyboard, b"4")
    assert terminal.answer(0.0) is None
    os.write(keyboard, b"00\n")
    assert terminal.answer(60.0) == "400"


def test_a_closed_terminal_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    keys, screen = os.pipe()
    os.close(screen)
    with os.fdopen(keys, "r") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with pytest.raises(DeviceLostError, match="the terminal is closed"):
            Terminal("stage").answer(60.0)


def test_without_a_terminal_it_says_so_and_names_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    config = ManualStageConfig(kind="manual", travel_mm=(400.0, 900.0))
    with open(os.devnull, encoding="ascii") as nobody:  # noqa: PTH123
        monkeypatch.setattr("sys.stdin", nobody)
        with pytest.raises(DeviceNotFoundError, match=r"standard input is none.*manual-stage\.md"):
            ManualStage(config, VirtualClock(), Terminal("stage")).__enter__()


def test_the_scripted_person_runs_out_of_words() -> None:
    person = ScriptedPerson(VirtualClock(), ["a"], 0.0)
    assert [person.answer(1.0), person.answer(1.0)] == ["a", ""]
