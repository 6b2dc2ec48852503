"""Which frames of a stream are passed over."""

from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.late import LatenessRule


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
