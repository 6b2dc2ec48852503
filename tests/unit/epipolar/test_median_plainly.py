"""The guided median beside a sum over a sorted list; jumps, and what lies near them."""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.median import guided_median, near_jumps
from rig.epipolar.rank import (
    departure,
    highest,
    jumps,
    lowest,
    mean,
    median_of_nine,
    middle_of,
    quantile,
)

RNG = np.random.default_rng(9)
SHAPE = (11, 30)


def plain_median(
    slope: NDArray[np.float32], grey: NDArray[np.float32], v: int, u: int, radius_px: int
) -> float:
    """The least value that half of the weight lies at or below."""
    values, weights = [], []
    for y in range(max(v - radius_px, 0), min(v + radius_px + 1, SHAPE[0])):
        for x in range(max(u - radius_px, 0), min(u + radius_px + 1, SHAPE[1])):
            if (y - v + x - u) % 2 == 0:
                values.append(float(slope[y, x]))
                d = (float(grey[y, x]) - float(grey[v, u])) / 12.0
                weights.append(1 / (1 + d * d) ** 2)
    order = np.argsort(values)
    sums = np.cumsum(np.array(weights)[order])
    at = int(np.searchsorted(sums, 0.5 * sums[-1]))
    return values[order[at]]


def test_the_median_is_the_value_that_half_of_the_weight_lies_below():
    slope = RNG.choice([0.0, 4.0, 8.0, 16.0], SHAPE).astype(np.float32)
    grey = RNG.uniform(0, 60, SHAPE).astype(np.float32)
    where = RNG.random(SHAPE) < 0.6
    found = guided_median(slope, grey, where, radius_px=2, grey_scale=12.0)
    assert np.array_equal(found[~where], slope[~where])
    for v, u in np.argwhere(where):
        expected = plain_median(slope, grey, v, u, 2)
        # Sixteen over 32: the last interval holds one of the values alone, or touches two.
        assert abs(found[v, u] - expected) < 1e-3, (v, u)


def test_more_pixels_than_one_block_are_replaced():
    slope = RNG.choice([0.0, 4.0], (20, 20)).astype(np.float32)
    grey = np.where(slope > 0, 200.0, 10.0).astype(np.float32)
    everywhere = np.ones(slope.shape, np.bool_)
    found = guided_median(slope, grey, everywhere, radius_px=3, grey_scale=5.0)
    assert np.abs(found - slope).max() < 1e-3


STEP = np.zeros((7, 9), np.float32)
STEP[3, 4] = 2.0


def test_near_jumps_reach_as_far_as_asked():
    assert not near_jumps(STEP, 2.0, 1).any()
    near = near_jumps(STEP, 1.9, 1)
    rows, columns = np.abs(np.arange(7) - 3)[:, None], np.abs(np.arange(9) - 4)
    # The pixel and its four neighbours are at the jump; one pixel around each is near it.
    assert np.array_equal(near, (np.maximum(rows, columns) <= 2) & (rows + columns <= 3))


def test_ranks_of_a_neighbourhood():
    values = RNG.uniform(0, 9, (6, 8)).astype(np.float32)
    middle = values[1:4, 2:5]
    assert median_of_nine(values)[2, 3] == np.median(middle)
    assert lowest(values, 1)[2, 3] == middle.min()
    assert highest(values, 1)[2, 3] == middle.max()
    assert np.isclose(mean(values, 1)[2, 3], middle.mean())
    assert highest(values, 2)[2, 3] == values[0:5, 1:6].max()
    assert jumps(STEP, 1.0)[[3, 2, 2], [4, 4, 3]].tolist() == [True, True, False]


def test_departure_from_a_plane():
    rows, columns = np.mgrid[0:9, 0:11].astype(np.float32)
    tilted = 0.5 * rows - 0.25 * columns + 3.0
    assert not departure(tilted, 2).any()
    tilted[4, 5] += 2.0
    # A spike departs by twice its height at its own place, by its height beside it.
    alone = departure(tilted, 1)
    assert alone[4, 5] == alone[3, 4] == 4.0
    assert alone[4, 7] == alone[2, 3] == 2.0
    assert alone[4, 8] == 0.0
    wide = departure(tilted, 3)
    assert wide[2, 3] == 4.0
    assert wide[1, 2] == 2.0
    crease = np.abs(columns - 5)
    assert departure(crease, 2)[4].tolist() == [0, 0, 0, 0, 2, 2, 2, 0, 0, 0, 0]
    diagonal = np.abs(columns - rows)
    assert departure(diagonal, 2)[4, 4] == 4.0


def test_quantiles_lie_between_ranks_in_proportion():
    assert quantile(np.array([4.0, 1.0, 3.0]), 0.25) == 2.0
    assert quantile(np.array([4.0, 1.0, 3.0]), 1.0) == 4.0
    assert quantile(np.array([7.0]), 0.3) == 7.0


def test_the_middle_is_the_larger_of_two():
    assert middle_of(np.array([[5.0, 1.0], [9.0, 2.0]])) == 5.0
    assert middle_of(np.array([7.0, -1.0, 3.0])) == 3.0


def test_a_median_at_the_border_takes_only_what_lies_in_the_picture():
    slope = np.array([[4.0, 4.0, 0.0], [4.0, 0.0, 0.0]], np.float32)
    found = guided_median(slope, np.ones_like(slope), slope > 9, radius_px=1, grey_scale=1.0)
    assert np.array_equal(found, slope)
    corner = np.zeros(slope.shape, np.bool_)
    corner[0, 0] = True
    # Itself and the one across: half of the weight lies at or below the lower.
    found = guided_median(slope, np.ones_like(slope), corner, radius_px=1, grey_scale=1.0)
    assert found[0, 0] == 0.0
    assert found[0, 1] == 4.0
