"""Plans at their borders: the ends of the travel, roles by place, ramps of a move."""

import pytest

from rig.errors import ConfigError, StageLimitError
from rig.plan import even_distances_mm, move_time_s, plan_stops


def visits(count: int, holdout_every: int, backward_every: int) -> tuple[list[int], list[int]]:
    """Places held out, and places of the way back, of `count` distances."""
    stops = plan_stops(
        [10.0 * place for place in range(count)],
        holdout_every=holdout_every,
        backward_every=backward_every,
        travel_mm=(0.0, 10.0 * (count - 1)),
        stage="stage",
    )
    forward = [stop for stop in stops if stop.direction == "forward"]
    back = [stop for stop in stops if stop.direction == "backward"]
    held = {round(stop.distance_mm / 10) for stop in stops if stop.role == "holdout"}
    assert len(forward) == count
    return sorted(held), [round(stop.distance_mm / 10) for stop in back]


@pytest.mark.parametrize(
    ("count", "every", "held"),
    [
        (9, 4, [2, 6]),
        (9, 3, [1, 4, 7]),
        (9, 2, [1, 3, 5, 7]),
        (9, 1, [1, 2, 3, 4, 5, 6, 7]),
        (9, 5, [2, 7]),
        (9, 0, []),
        (7, 4, [2]),
        (2, 1, []),
    ],
)
def test_the_middle_of_every_so_many_is_held_out_but_no_end(
    count: int, every: int, held: list[int]
) -> None:
    assert visits(count, every, 0) == (held, [])


@pytest.mark.parametrize(
    ("count", "every", "back"),
    [
        (9, 4, [4, 0]),
        (9, 3, [6, 3, 0]),
        (9, 1, [7, 6, 5, 4, 3, 2, 1, 0]),
        (9, 0, []),
        (8, 7, [0]),
        (3, 2, [0]),
    ],
)
def test_the_way_back_visits_every_so_many_but_not_where_it_turns(
    count: int, every: int, back: list[int]
) -> None:
    assert visits(count, 0, every) == ([], back)


def plan(distances_mm: list[float]) -> list[float]:
    stops = plan_stops(
        distances_mm, holdout_every=0, backward_every=0, travel_mm=(100.0, 900.0), stage="rail"
    )
    return [stop.distance_mm for stop in stops]


def test_both_ends_of_the_travel_can_be_reached() -> None:
    assert plan([900.0, 100.0]) == [100.0, 900.0]
    for outside_mm in (99.999, 900.001):
        with pytest.raises(StageLimitError) as refused:
            plan([500.0, outside_mm])
        assert refused.value.wanted_mm == outside_mm


def test_what_is_wrong_with_distances_is_told() -> None:
    with pytest.raises(ConfigError, match=r"300\.0 mm is asked for twice"):
        plan([300.0, 200.0, 300.0])
    for wrong in ([], [200.0, float("nan")], [float("-inf")]):
        with pytest.raises(ConfigError, match="give finite numbers"):
            plan(wrong)


def test_ten_thousand_distances_are_the_most() -> None:
    held, _ = visits(10_000, 0, 0)
    assert held == []
    with pytest.raises(ConfigError, match="asked for 10001 distances, most are 10000"):
        visits(10_001, 0, 0)


def test_two_distances_are_the_fewest() -> None:
    assert even_distances_mm(300.0, 100.0, 2) == (300.0, 100.0)
    assert even_distances_mm(0.0, 1.0, 5) == (0.0, 0.25, 0.5, 0.75, 1.0)
    with pytest.raises(ConfigError, match="asked for 1 distances"):
        even_distances_mm(0.0, 1.0, 1)


def test_a_move_ramps_up_and_down() -> None:
    """50 mm/s at 200 mm/s2 are reached after 6.25 mm: twice that is the shortest with both."""
    assert move_time_s(12.5, 50.0, 200.0) == pytest.approx(0.5)
    assert move_time_s(12.4, 50.0, 200.0) == pytest.approx(2 * (12.4 / 200.0) ** 0.5)
    assert move_time_s(12.6, 50.0, 200.0) == pytest.approx(12.6 / 50.0 + 0.25)
    assert move_time_s(0.0, 50.0, 200.0) == 0.0
