"""Maps as whole steps: what is lost is at most half of one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from rig.view.packing import as_8_bit, packed, step_of

NAN = float("nan")


@pytest.mark.parametrize(
    ("largest", "step"),
    [
        (0.0, 1e-4),
        (6.5, 1e-4),
        (6.6, 2e-4),
        (1200.0, 0.02),
        (1301.0, 0.05),
        (3251.0, 0.1),
        (6500.0, 0.1),
        (6501.0, 0.2),
        (65000.0, 1.0),
    ],
)
def test_the_step_is_the_smallest_round_one_that_reaches(largest: float, step: float):
    assert step_of(largest) == pytest.approx(step, rel=1e-12)


def test_depth_in_steps_zero_only_where_there_is_none():
    found = packed(np.array([[1000.0, NAN], [0.0, 6500.0], [0.06, 0.04]], np.float32))
    assert found.step == pytest.approx(0.1)
    assert found.low == 0.0
    assert found.steps.dtype == np.uint16
    assert found.steps.tolist() == [[10001, 0], [1, 65001], [2, 1]]


def test_slopes_in_steps_from_the_smallest():
    found = packed(np.array([[-3.0, NAN, 3.5]], np.float32), low=None)
    assert found.step == pytest.approx(1e-4)
    assert found.low == -3.0
    assert found.steps.tolist() == [[1, 0, 65001]]


def test_every_row_of_a_large_map_is_there():
    rows = np.repeat(np.arange(65, dtype=np.float32)[:, None], 2, axis=1)
    found = packed(rows)
    assert found.step == pytest.approx(1e-3)
    assert found.steps[:, 1].tolist() == [1000 * row + 1 for row in range(65)]


def test_a_map_without_an_answer():
    for low in (0.0, None):
        found = packed(np.full((2, 3), NAN, np.float32), low=low)
        assert found.steps.tolist() == [[0] * 3] * 2
        assert (found.step, found.low) == (1e-4, 0.0)


maps = hnp.arrays(
    np.float32,
    hnp.array_shapes(min_dims=2, max_dims=2, max_side=6),
    elements=st.floats(0.0078125, 100000.0, width=32) | st.just(NAN),
)


@given(maps)
def test_half_a_step_at_most_is_lost(values: NDArray[np.float32]):
    known = ~np.isnan(values)
    for map_, found in ((values, packed(values)), (-values, packed(-values, low=None))):
        np.testing.assert_array_equal(found.steps > 0, known)
        back = found.low + (found.steps - 1.0) * found.step
        lost = np.abs(back - map_)[known]
        # Single precision holds a step of 65000 to about a hundredth.
        assert np.all(lost <= 0.52 * found.step)


def test_grey_values_by_their_highest_eight_bits():
    image = np.array([[0, 3, 4, 1023]], np.uint16)
    assert as_8_bit(image, 10).tolist() == [[0, 0, 1, 255]]
    assert as_8_bit(image, 10).dtype == np.uint8
    assert as_8_bit(np.array([[200]], np.uint16), 8).tolist() == [[200]]
    eight = np.array([[7]], np.uint8)
    assert as_8_bit(eight, 8) is eight
