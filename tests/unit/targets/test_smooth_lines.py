"""Straight, evenly bent and broken lines of corners, told apart at the limits."""

import numpy as np
import pytest

from rig.targets.smooth_lines import smooth_triples


def line(*steps_px: tuple[float, float]) -> np.ndarray:
    """(R, 1, 2) corners with these steps between them."""
    return np.cumsum([(0.0, 0.0), *steps_px], axis=0)[:, None]


@pytest.mark.parametrize(("change", "is_smooth"), [(1.49, True), (1.51, False), (-1.51, False)])
def test_a_line_of_three_may_change_its_step_by_the_share(change: float, is_smooth: bool) -> None:
    three = line((10.0, 0.0), (10.0 + max(change, 0.0), min(change, 0.0)))
    assert smooth_triples(three, 0.15).tolist() == [[is_smooth]]


def test_the_shorter_step_is_what_the_share_is_of() -> None:
    assert smooth_triples(line((12.0, 0.0), (10.0, 0.0)), 0.2).tolist() == [[True]]
    assert smooth_triples(line((12.2, 0.0), (10.0, 0.0)), 0.2).tolist() == [[False]]


def test_corners_that_are_not_refined_may_miss_by_their_error_more() -> None:
    three = line((10.0, 0.0), (10.0, 2.0))
    assert not smooth_triples(three, 0.15, 0.4).any()
    assert smooth_triples(three, 0.15, 0.6).all()


def test_an_evenly_bent_line_is_smooth_however_much_a_lens_bends_it() -> None:
    # Each step turns by 0.4 rad: by 0.4 of itself, and this turns by 0.4 of that.
    angle_rad = 0.4 * np.arange(6)
    arc = line(*(tuple(step) for step in 10 * np.stack([np.cos(angle_rad), np.sin(angle_rad)], 1)))
    assert smooth_triples(arc, 0.2).all()
    assert not smooth_triples(arc, 0.1).any()


def test_no_lens_bends_a_line_by_more_than_six_tenths_of_a_step() -> None:
    def arc(turn_rad: float) -> np.ndarray:
        angle_rad = turn_rad * np.arange(6)
        steps = 10 * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
        return line(*(tuple(step) for step in steps))

    # A chord of the turn: 2 sin(turn / 2) steps.
    assert smooth_triples(arc(0.59), 0.4).all()
    assert not smooth_triples(arc(0.62), 0.4).any()


def test_a_corner_beside_its_place_breaks_the_triples_that_hold_it() -> None:
    points = line(*[(10.0, 0.0)] * 7)
    points[3, 0, 1] += 4.0
    assert smooth_triples(points, 0.15)[:, 0].tolist() == [True, False, False, False, True, True]


def test_a_stray_at_the_end_of_a_bent_line_is_not_of_it() -> None:
    angle_rad = 0.3 * np.arange(5)
    steps = 10 * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    bent = line(*(tuple(step) for step in steps))
    assert smooth_triples(bent, 0.15).all()
    bent[-1, 0] += (-3.0, 0.0)  # more bent than the others by its error
    assert smooth_triples(bent, 0.15)[:, 0].tolist() == [True, True, True, False]


def test_a_triple_with_a_missing_corner_counts_as_smooth() -> None:
    points = line((10.0, 0.0), (10.0, 9.0), (10.0, 0.0))
    points[0] = np.nan
    assert smooth_triples(points, 0.15)[:, 0].tolist() == [True, False]
