"""Ctrl-C that never tears a sample apart."""

import os
import signal
from typing import cast

import pytest

from rig.devices import Stage, stopped
from rig.errors import DeviceLostError
from rig.interrupts import Interrupted, Interrupts, is_ignored, received, saved_now, saying


def press_ctrl_c(number: int = signal.SIGINT) -> None:
    os.kill(os.getpid(), number)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_outside_a_sample_it_comes_at_once(number: int):
    with Interrupts(), pytest.raises(KeyboardInterrupt):
        press_ctrl_c(number)


def test_inside_a_sample_it_waits_for_the_end():
    steps: list[str] = []
    with Interrupts() as interrupts:
        with pytest.raises(KeyboardInterrupt), interrupts.deferred():
            press_ctrl_c()
            steps.append("sample finished")
        with interrupts.deferred():
            steps.append("not raised twice")
    assert steps == ["sample finished", "not raised twice"]


def test_a_second_one_does_not_wait():
    steps: list[str] = []
    with Interrupts() as interrupts, pytest.raises(KeyboardInterrupt), interrupts.deferred():
        press_ctrl_c()
        press_ctrl_c()
        steps.append("never reached")
    assert steps == []


def test_the_old_handlers_come_back():
    before = signal.getsignal(signal.SIGINT)
    with Interrupts():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


def test_what_ends_a_motion_is_not_torn_apart_however_often_it_is_pressed():
    steps: list[str] = []
    with Interrupts() as interrupts:
        assert interrupts.came is False
        with pytest.raises(KeyboardInterrupt), interrupts.shielded():
            press_ctrl_c()
            press_ctrl_c()
            press_ctrl_c(signal.SIGTERM)
            steps.append("stopped")
        assert interrupts.came is True
        with interrupts.shielded():
            steps.append("not raised twice")
        with interrupts.deferred(), interrupts.shielded():
            steps.append("inside a sample")
    assert steps == ["stopped", "not raised twice", "inside a sample"]


def test_inside_a_sample_the_end_of_a_shield_is_not_yet_the_moment():
    steps: list[str] = []
    with Interrupts() as interrupts, pytest.raises(KeyboardInterrupt), interrupts.deferred():
        with interrupts.shielded():
            press_ctrl_c()
        steps.append("sample finished")
    assert steps == ["sample finished"]


def test_every_signal_is_remembered():
    received.clear()
    with Interrupts() as interrupts, pytest.raises(KeyboardInterrupt), interrupts.deferred():
        press_ctrl_c(signal.SIGTERM)
    assert received == [signal.SIGTERM]
    received.clear()


def test_a_hangup_that_nohup_ignores_is_left_alone():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert is_ignored(signal.SIGHUP)
        assert not is_ignored(signal.SIGTERM)
        with Interrupts() as interrupts:
            press_ctrl_c(signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert not interrupts.came
    finally:
        signal.signal(signal.SIGHUP, before)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        # A shell that starts a program in the background hands Ctrl-C down ignored.
        assert not is_ignored(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


def test_the_innermost_that_knows_says_what_was_saved():
    assert saved_now() is None
    with pytest.raises(Interrupted) as ended, saying(lambda: "outer"):
        assert saved_now() == "outer"
        with saying(lambda: "inner"):
            assert saved_now() == "inner"
            raise KeyboardInterrupt
    assert ended.value.saved == "inner"
    assert saved_now() is None
    with pytest.raises(ValueError, match="another error"), saying(lambda: "outer"):
        raise ValueError("another error")
    assert saved_now() is None


class Stubborn:
    """A stage whose stopping raises."""

    def __init__(self, error: Exception) -> None:
        self._error = error

    def stop(self) -> None:
        raise self._error


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (
            DeviceLostError("stage", "no answer", advice="plug it in"),
            "stage: no answer; plug it in",
        ),
        (
            OSError(5, "Input/output\nerror"),
            "the stage may still move, it could not be stopped (OSError: [Errno 5] Input/output "
            "error); cut its power",
        ),
    ],
)
def test_whatever_stopping_raises_is_said(error: Exception, says: str):
    assert stopped(cast("Stage", Stubborn(error))) == says
