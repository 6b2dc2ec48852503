"""Pairs of views that disagree: how far, whose fault, and since when."""

from dataclasses import replace

import numpy as np
import pytest

from rig.arrays import Float
from rig.geometry.bundle.agreement import Pair, blame, compare_views, find_step
from rig.geometry.bundle.alone import Alone
from rig.geometry.bundle.observations import Observations

NOISE_PX = np.array([0.01, 0.02, 0.03])


def observed(views: list[int], sizes: list[int]) -> Observations:
    """One picture."""
    count = sum(sizes)
    return Observations(
        pictures=(4,),
        start=np.cumsum([0, *sizes]),
        picture=np.zeros(len(views), np.int64),
        view=np.array(views),
        ids=np.zeros(count, np.int64),
        xy_px=np.zeros((count, 2)),
        sigma_px=np.ones(count),
    )


def alone(motion: Float, information: list[float]) -> Alone:
    eyes = np.array(information)[:, None, None] * np.eye(6)
    count = len(motion)
    return Alone(motion, eyes, np.ones(count), NOISE_PX, np.ones(count))


def test_motions_are_compared_with_the_information_of_both() -> None:
    motion = np.arange(12.0).reshape(2, 6)
    motion[1] += 1.0
    (pair,) = compare_views(observed([0, 2], [12, 13]), alone(motion, [2.0, 6.0]), 0.0)
    assert pair.views == (0, 2)
    assert (pair.picture, pair.sightings) == (0, (0, 1))
    assert pair.motion.tolist() == [7.0] * 6
    assert pair.information == pytest.approx(1.5 * np.eye(6))


def test_views_of_few_points_are_not_compared() -> None:
    found = compare_views(
        observed([0, 1, 2], [12, 11, 12]), alone(np.zeros((3, 6)), [1.0] * 3), 0.0
    )
    assert [pair.sightings for pair in found] == [(0, 2)]


@pytest.mark.parametrize(("square", "apart"), [(215.0, False), (217.0, True)])
def test_six_sigmas_of_each_of_six_numbers_are_apart(square: float, apart: bool) -> None:
    motion = np.zeros((2, 6))
    motion[1, 2] = np.sqrt(2 * square)  # of information 1 and 1: a half
    (pair,) = compare_views(observed([0, 1], [12, 12]), alone(motion, [1.0, 1.0]), 0.0)
    assert bool(pair.apart) is apart


@pytest.mark.parametrize(("per_point", "apart"), [(15.9, False), (16.1, True)])
@pytest.mark.parametrize("swapped", [False, True])
def test_points_are_apart_by_four_times_the_noise_of_the_less_sure_view(
    per_point: float, apart: bool, swapped: bool
) -> None:
    """The one has 20 points and information 1; the other far more of either."""
    motion = np.zeros((2, 6))
    motion[1, 2] = np.sqrt(per_point * 20)
    given = alone(motion, [1000.0, 1.0] if swapped else [1.0, 1000.0])
    sizes = [40, 20] if swapped else [20, 40]
    (pair,) = compare_views(observed([0, 1], sizes), given, 0.0)
    assert bool(pair.apart) is apart


@pytest.mark.parametrize(("least_px", "apart"), [(0.0499, True), (0.0501, False)])
@pytest.mark.parametrize("views", [[0, 1], [1, 0]])
def test_views_whose_points_are_hardly_apart_agree_however_sure_they_are(
    least_px: float, apart: bool, views: list[int]
) -> None:
    """Five times the noise of view 0, and of view 1: by the smaller of the two in px."""
    motion = np.zeros((2, 6))
    motion[1, 2] = np.sqrt(5.0**2 * 20)
    (pair,) = compare_views(observed(views, [20, 20]), alone(motion, [1.0, 1.0]), least_px)
    assert bool(pair.apart) is apart


def pair(picture: int, views: tuple[int, int], shift: float = 0.0, *, apart: bool = True) -> Pair:
    motion = np.array([shift, 0.0, 0.0, 0.0, 0.0, 0.0])
    return Pair(picture, views, (0, 1), motion, np.eye(6), apart)


def test_the_view_in_most_bad_pairs_is_to_blame() -> None:
    assert blame([pair(0, (0, 1), apart=False)], 3) == []
    assert blame([pair(0, (0, 1)), pair(0, (1, 2))], 3) == [(1,)]
    assert blame([pair(0, (0, 1))], 3) == [(0, 1)]
    assert blame([pair(0, (0, 1)), pair(0, (0, 2)), pair(0, (1, 2))], 3) == [(0,), (1, 2)]
    several = [pair(0, (0, 1)), pair(0, (1, 2)), pair(1, (1, 3)), pair(1, (3, 4)), pair(2, (3, 4))]
    assert blame(several, 5) == [(1, 3)]


def steps(*shifts: float) -> list[Pair]:
    return [pair(10 + k, (0, 1), shift) for k, shift in enumerate(shifts)]


def test_a_step_is_found_at_the_first_picture_after_it() -> None:
    assert find_step(steps(0, 0, 0, 30, 30, 30)) == 13
    assert find_step(steps(0, 0, 0, 0, 30, 30, 30)) == 14
    assert find_step(steps(1, -1, 0, 30, 31, 29, 30)) == 13


def test_a_step_needs_three_pictures_before_and_after() -> None:
    assert find_step(steps(0, 0, 0, 30, 30)) is None
    assert find_step(steps(0, 0, 90, 90, 90, 90)) is None
    assert find_step(steps(0, 0, 0, 0, 90, 90)) is None


@pytest.mark.parametrize(("shift", "step"), [(11.9, None), (12.1, 13)])
def test_a_step_is_beyond_six_sigmas(shift: float, step: int | None) -> None:
    """Three and three pictures: chi-square 6 (shift / 2)^2 against 216."""
    assert find_step(steps(0, 0, 0, shift, shift, shift)) == step


@pytest.mark.parametrize(("share", "step"), [(0.99, 13), (1.01, None)])
def test_a_step_leaves_less_than_three_tenths(share: float, step: int | None) -> None:
    """Before and after, pictures lie at -w, 0 and w about 0 and 100.

    Left is 4 w^2 of 4 w^2 + 1.5 * 100^2: three tenths at w^2 = 0.45 / 2.8 * 100^2.
    """
    wide = share * 100 * np.sqrt(0.45 / 2.8)
    assert find_step(steps(-wide, 0, wide, 100 - wide, 100, 100 + wide)) == step


def test_one_picture_that_outweighs_all_others_is_no_step() -> None:
    """Its side of the split lies at it; without it nothing disagrees."""
    shaken = steps(0, 1, 0, -1, 30, 0, 1, 0)
    heavy = replace(shaken[4], information=100.0 * np.eye(6))
    pairs = [*shaken[:4], heavy, *shaken[5:]]
    assert find_step(pairs) is None
    moved = [replace(one, motion=one.motion + 30.0 * np.eye(6)[0]) for one in pairs[5:]]
    assert find_step([*pairs[:5], *moved]) == 14
