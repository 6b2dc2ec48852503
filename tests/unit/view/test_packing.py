"""Maps as whole steps: what is lost is at most half of one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from rig.view.packing import NO_VALUE, as_8_bit, packed, packed_signed, step_of

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
    values = np.array([[1000.0, NAN], [0.0, 6500.0]], np.float32)
    steps, step = packed(values)
    assert step == pytest.approx(0.1)
    assert steps.dtype == np.uint16
    assert steps.tolist() == [[10000, 0], [1, 65000]]


def test_slopes_in_steps_of_either_sign():
    steps, step = packed_signed(np.array([[-3.0, NAN, 3.25]], np.float32))
    assert step == pytest.approx(1e-4)
    assert steps.tolist() == [[-30000, NO_VALUE, 32500]]


def test_a_map_without_an_answer():
    blind = np.full((2, 3), NAN, np.float32)
    assert packed(blind)[0].tolist() == [[0] * 3] * 2
    assert packed_signed(blind)[0].tolist() == [[NO_VALUE] * 3] * 2


maps = hnp.arrays(
    np.float32,
    hnp.array_shapes(min_dims=2, max_dims=2, max_side=6),
    elements=st.floats(0.0078125, 100000.0, width=32) | st.just(NAN),
)


@given(maps)
def test_half_a_step_at_most_is_lost(values: NDArray[np.float32]):
    steps, step = packed(values)
    known = ~np.isnan(values)
    np.testing.assert_array_equal(steps > 0, known)
    least = np.maximum(values, step)  # what would round to none counts as one step
    assert np.all(np.abs(steps * step - least)[known] <= step * 0.51 + 1e-6 * values[known])
    signed, step = packed_signed(-values)
    np.testing.assert_array_equal(signed != NO_VALUE, known)
    assert np.all(np.abs(signed * step + values)[known] <= step * 0.51 + 1e-6 * values[known])


def test_grey_values_by_their_highest_eight_bits():
    image = np.array([[0, 3, 4, 1023]], np.uint16)
    assert as_8_bit(image, 10).tolist() == [[0, 0, 1, 255]]
    assert as_8_bit(image, 10).dtype == np.uint8
    assert as_8_bit(np.array([[200]], np.uint16), 8).tolist() == [[200]]
    eight = np.array([[7]], np.uint8)
    assert as_8_bit(eight, 8) is eight
