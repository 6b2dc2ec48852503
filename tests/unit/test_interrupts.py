"""Ctrl-C that never tears a sample apart."""

import os
import signal

import pytest

from rig.interrupts import Interrupts


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
