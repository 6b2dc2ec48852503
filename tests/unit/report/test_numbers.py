import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.report.numbers import UNKNOWN, digits, fixed, signed, with_sigma

FINITE = st.floats(-1e6, 1e6, allow_nan=False)


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_what_is_unknown_is_a_dash(value: float | None) -> None:
    assert fixed(value, 2) == signed(value, 2) == digits(value) == UNKNOWN


@pytest.mark.parametrize(
    ("value", "count", "text"),
    [
        (0.000123456, 2, "0.00012"),
        (0.0999, 1, "0.1"),
        (0.00996, 2, "0.010"),
        (12.345, 2, "12"),
        (-1234.5, 2, "-1234"),
        (0.0, 2, "0.00"),
    ],
)
def test_significant_digits(value: float, count: int, text: str) -> None:
    assert digits(value, count) == text


@settings(deadline=None, max_examples=200)
@given(FINITE.filter(lambda x: abs(x) > 1e-9), st.integers(1, 6))
def test_digits_err_by_half_of_the_last_one(value: float, count: int) -> None:
    text = digits(value, count)
    assert "e" not in text
    assert abs(float(text) - value) <= 0.5001 * abs(value) * 10.0 ** (1 - count) + 1e-12


@settings(deadline=None, max_examples=200)
@given(FINITE, st.integers(0, 6))
def test_no_zero_is_negative(value: float, decimals: int) -> None:
    text = fixed(value, decimals)
    assert not (text.startswith("-") and float(text) == 0.0)
    assert abs(float(text) - value) <= 0.5001 * 10.0**-decimals + 1e-9


def test_a_value_is_given_as_far_as_its_uncertainty_lets_it_mean() -> None:
    assert with_sigma(700.02345, 0.0256) == "700.023 ± 0.051"
    assert with_sigma(12202.3, 55.0) == "12202 ± 110"
    assert with_sigma(1.0, math.nan) == UNKNOWN
