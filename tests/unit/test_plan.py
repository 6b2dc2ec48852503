"""Plans: which distances, in which order, in which role."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import ConfigError, StageLimitError
from rig.plan import Stop, even_distances_mm, move_time_s, plan_stops

TRAVEL_MM = (100.0, 900.0)


def plan(distances_mm: list[float], holdout_every: int = 4, backward_every: int = 4):
    return plan_stops(
        distances_mm,
        holdout_every=holdout_every,
        backward_every=backward_every,
        travel_mm=TRAVEL_MM,
        stage="stage",
    )


def test_both_ends_are_visited():
    assert even_distances_mm(100.0, 300.0, 3) == (100.0, 200.0, 300.0)


@pytest.mark.parametrize(("first", "last", "count"), [(1.0, 2.0, 1), (5.0, 5.0, 4)])
def test_no_range_is_refused(first: float, last: float, count: int):
    with pytest.raises(ConfigError, match="two distances or more"):
        even_distances_mm(first, last, count)


def test_forward_then_some_backward_every_fourth_held_out():
    stops = plan([float(d) for d in range(100, 1000, 100)])
    assert [s.distance_mm for s in stops] == [*range(100, 1000, 100), 500, 100]
    assert [s.direction for s in stops] == ["forward"] * 9 + ["backward"] * 2
    assert [s.distance_mm for s in stops if s.role == "holdout"] == [300, 700]
    assert [s.index for s in stops] == list(range(11))


def test_a_list_is_visited_from_near_to_far():
    assert [s.distance_mm for s in plan([300.0, 100.0, 200.0], 0, 0)] == [100.0, 200.0, 300.0]


@pytest.mark.parametrize("outside_mm", [99.9, 900.1])
def test_a_distance_outside_the_travel_is_refused_with_the_travel(outside_mm: float):
    with pytest.raises(StageLimitError, match=r"travel is 100\.000\.\.900\.000 mm") as caught:
        plan([200.0, outside_mm])
    assert caught.value.wanted_mm == outside_mm


@pytest.mark.parametrize("distances_mm", [[], [200.0, 200.0], [float("nan")], [float("inf")]])
def test_what_is_no_plan_is_refused(distances_mm: list[float]):
    with pytest.raises(ConfigError):
        plan(distances_mm)


@given(
    st.lists(st.floats(100.0, 900.0), min_size=1, max_size=30, unique=True),
    st.integers(0, 6),
    st.integers(0, 6),
)
def test_any_plan_visits_everything_and_fits_both_ends(
    distances_mm: list[float], holdout_every: int, backward_every: int
):
    stops = plan(distances_mm, holdout_every, backward_every)
    forward = [s for s in stops if s.direction == "forward"]
    assert [s.distance_mm for s in forward] == sorted(distances_mm)
    assert forward[0].role == forward[-1].role == "fit"
    role = {s.distance_mm: s.role for s in forward}
    backward: list[Stop] = [s for s in stops if s.direction == "backward"]
    assert all(s.role == role[s.distance_mm] for s in backward)
    assert sorted((s.distance_mm for s in backward), reverse=True) == [
        s.distance_mm for s in backward
    ]


def test_time_of_a_move_in_closed_form():
    # 100 mm at 50 mm/s, 0.25 s of ramp at each end: 2 s and half of both ramps
    assert move_time_s(100.0, 50.0, 200.0) == pytest.approx(2.25)
    assert move_time_s(-2.0, 50.0, 200.0) == pytest.approx(0.2)
