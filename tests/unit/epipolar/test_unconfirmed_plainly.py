"""Variance of slopes by what the other view of a pair leaves open, pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.search.found import Found
from rig.epipolar.search.window import Cameras
from rig.epipolar.unconfirmed import is_confirmed, unconfirmed_variance

SHAPE = (30, 40)
PAIR = Cameras(np.array([0.0, 2.0]), np.zeros(2), 0)
NOWHERE = np.zeros(SHAPE, np.bool_)


def filled(value: float) -> NDArray[np.float32]:
    return np.full(SHAPE, value, np.float32)


def jump(height_px: float) -> NDArray[np.float32]:
    slope = filled(1.0)
    slope[:, 20:] += height_px
    return slope


CONFIRMED = Found.of_all(filled(1.0), filled(np.nan))


def variance(
    found: Found, slope: NDArray[np.float32], against: NDArray[np.bool_] = NOWHERE
) -> NDArray[np.float32]:
    told = unconfirmed_variance(found, slope, against, PAIR)
    assert told is not None
    return told


def test_nothing_is_open_where_all_is_confirmed():
    assert unconfirmed_variance(CONFIRMED, jump(9.0), NOWHERE, PAIR) is None
    assert is_confirmed(CONFIRMED).all()


def test_two_readings_tell_their_error_and_one_pixel_is_no_band():
    apart = filled(0.0)
    apart[15, 5] = 3.0
    found = replace(CONFIRMED, apart_px=apart)
    told = variance(found, filled(1.0))
    assert told[15, 5] == pytest.approx(0.5 * 9.0)
    assert np.count_nonzero(told) == 1
    rows, columns = np.nonzero(~is_confirmed(found))
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (12, 18, 2, 8)


def test_the_surroundings_of_a_band_are_off_now_and_then():
    apart = filled(0.0)
    apart[14:17, 5:8] = 8.0
    told = variance(replace(CONFIRMED, apart_px=apart), filled(1.0))
    rows, columns = np.nonzero(told)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (11, 19, 2, 10)
    assert told[11, 2] == pytest.approx(64.0 / 16)
    assert told[15, 6] == pytest.approx(64.0 / 16 + 32.0)


def test_at_a_jump_beside_what_is_open_a_part_of_the_jump_is_unknown():
    unshared = NOWHERE.copy()
    unshared[15, 17] = True
    found = replace(CONFIRMED, unshared=unshared)
    told = variance(found, jump(0.51))  # a label of the search is half a px per step here
    rows, columns = np.nonzero(told)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (12, 18, 17, 20)
    assert told[12, 18] == pytest.approx(0.51**2 / 4)
    assert told[15, 17] == pytest.approx(0.51**2 / 4)
    lower = variance(found, jump(0.49))
    assert np.count_nonzero(lower) == 1
    assert lower[15, 17] == pytest.approx(0.49**2 / 4)


def test_what_grey_values_contradict_may_lie_on_the_other_side_of_any_jump_near():
    against = NOWHERE.copy()
    against[5, 16:24] = True
    told = variance(CONFIRMED, jump(6.0), against)
    assert told[5, 15:25] == pytest.approx([0, 0, *[9.0] * 6, 0, 0])
    assert not told[6].any()
