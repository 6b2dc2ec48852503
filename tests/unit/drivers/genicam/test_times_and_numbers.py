"""The clock and the counter of a camera, as the host reads them."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_genicam.clock_relation import ClockRelation
from rig_genicam.frame_numbers import FrameNumbers


def test_the_quickest_frame_tells_where_the_other_clock_stands():
    relation = ClockRelation()
    came = [relation.arrival_s(d, a) for d, a in [(100.0, 5.30), (100.1, 5.32), (100.2, 5.50)]]
    assert came == pytest.approx([5.30, 5.32, 5.42])


def test_a_clock_that_drifts_is_followed_after_sixty_four_frames():
    relation = ClockRelation()
    relation.arrival_s(0.0, 1.0)
    for number in range(1, 64):
        assert relation.arrival_s(float(number), number + 1.5) == pytest.approx(number + 1.0)
    assert relation.arrival_s(64.0, 65.5) == pytest.approx(65.5)


@pytest.mark.parametrize("device_s", [50.0, 100.0])
def test_a_clock_that_steps_back_begins_anew(device_s: float):
    relation = ClockRelation()
    relation.arrival_s(100.0, 5.0)
    assert relation.arrival_s(device_s, 7.0) == 7.0


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(0.001, 1.0), st.floats(0.0, 0.5)), min_size=1, max_size=80))
def test_no_frame_came_later_than_it_came(frames: list[tuple[float, float]]):
    relation, device_s = ClockRelation(), 0.0
    for step_s, late_s in frames:
        device_s += step_s
        arrived_s = device_s + 3.0 + late_s
        came_s = relation.arrival_s(device_s, arrived_s)
        assert device_s + 3.0 - 1e-9 <= came_s <= arrived_s + 1e-9


def numbered(*ids: int) -> tuple[list[int | None], int]:
    numbers = FrameNumbers()
    return [numbers.next(frame_id) for frame_id in ids], numbers.lost


def test_numbers_begin_with_0_wherever_the_camera_is():
    assert numbered(812, 813, 816) == ([0, 1, 4], 2)


@pytest.mark.parametrize(
    ("ids", "sequences", "lost"),
    [
        ((65534, 65535, 1, 2), [0, 1, 2, 3], 0),
        ((65535, 0, 1), [0, 1, 2], 0),
        ((65534, 2), [0, 3], 2),
        ((65535, 65536, 65537), [0, 1, 2], 0),
        ((57345, 8190), [0, 16380], 16379),
    ],
)
def test_a_short_counter_goes_on(ids: tuple[int, ...], sequences: list[int], lost: int):
    assert numbered(*ids) == (sequences, lost)


@pytest.mark.parametrize("ids", [(7, 7), (7, 6), (57344, 1), (65534, 8191), (70000, 1)])
def test_a_number_that_came_before_is_none(ids: tuple[int, int]):
    assert numbered(*ids) == ([0, None], 0)
