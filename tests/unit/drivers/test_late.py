"""Which frames of a stream are passed over."""

import itertools
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.late import LatenessRule, newest_frames
from rig_sim.clock import VirtualClock

from rig.errors import CaptureTimeoutError
from rig.frames import Frame

IMAGE = np.zeros((2, 2), np.uint8)


def test_a_frame_of_up_to_two_periods_is_in_time():
    rule = LatenessRule(0.05, waiting=4)
    assert not rule.passes_over(0.1)
    assert rule.passes_over(0.1001)


def test_after_as_many_as_can_wait_the_next_is_the_newest_however_old():
    rule = LatenessRule(0.05, waiting=3)
    assert [rule.passes_over(1.0) for _ in range(8)] == [True, True, True, False] * 2


def test_one_in_time_begins_the_count_again():
    rule = LatenessRule(0.05, waiting=2)
    assert [rule.passes_over(age_s) for age_s in (1.0, 0.0, 1.0, 1.0, 1.0)] == [
        *(True, False, True, True, False)
    ]


@given(st.lists(st.floats(0.0, 10.0), max_size=60), st.integers(1, 9))
def test_never_more_in_a_row_than_can_wait(ages_s: list[float], waiting: int):
    rule = LatenessRule(0.5, waiting)
    row = 0
    for age_s in ages_s:
        row = row + 1 if rule.passes_over(age_s) else 0
        assert row <= waiting


def frames_every(
    clock: VirtualClock, period_s: float, age_s: Callable[[int], float | None]
) -> Callable[[float], Frame | None]:
    """A device that gives a frame of some age (None: a damaged one) every period, or times out."""
    numbers = itertools.count()

    def take(deadline_s: float) -> Frame | None:
        if clock.now_s() + period_s > deadline_s:
            clock.sleep_s(max(0.0, deadline_s - clock.now_s()))
            raise CaptureTimeoutError("camera", missing=("a",), timeout_s=1.0)
        clock.sleep_s(period_s)
        number = next(numbers)
        age = age_s(number)
        return None if age is None else Frame("a", IMAGE, clock.now_s() - age, number)

    return take


@pytest.mark.parametrize("age_s", [50.0, None])
def test_frames_that_are_passed_over_give_no_further_time(age_s: float | None):
    clock = VirtualClock(100.0)
    frames = newest_frames(
        frames_every(clock, 0.3, lambda _: age_s),
        clock,
        LatenessRule(0.3, waiting=4),
        timeout_s=1.0,
        count_late=lambda: None,
    )
    with pytest.raises(CaptureTimeoutError):
        next(frames)
    assert clock.now_s() == pytest.approx(101.0)


def test_the_time_counts_from_when_a_frame_is_asked_for():
    clock, late = VirtualClock(100.0), Counter[str]()
    frames = newest_frames(
        frames_every(clock, 0.3, lambda number: 0.9 if number in (4, 5) else 0.0),
        clock,
        LatenessRule(0.3, waiting=4),
        timeout_s=1.0,
        count_late=lambda: late.update(late=1),
    )
    numbers: list[int] = []
    for frame in itertools.islice(frames, 6):
        numbers.append(frame.sequence)
        clock.sleep_s(7.0)  # whoever works on a frame needs no more of the camera's time
    assert numbers == [0, 1, 2, 3, 6, 7]
    assert late == {"late": 2}
