"""Percentiles of any number of durations, beside those of all of them kept."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.capture.spread import EXACT, Spread, SpreadTally


def spread_of(durations_s: list[float]) -> Spread:
    tally = SpreadTally()
    for duration_s in durations_s:
        tally.add(duration_s)
    return tally.spread


def values(spread: Spread) -> tuple[float, float, float]:
    return spread.median, spread.p95, spread.largest


def test_of_few_it_is_exact():
    durations_s = [0.001 * n for n in range(1, EXACT + 1)]
    assert values(spread_of(durations_s)) == pytest.approx((0.5005, 0.95005, 1.0))
    assert spread_of([-0.25]) == Spread(-0.25, -0.25, -0.25)
    assert all(math.isnan(value) for value in (spread_of([]).median, spread_of([]).p95))
    assert math.isnan(spread_of([]).largest)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), exponent=st.floats(-5.5, 3.0), width=st.floats(0.0, 2.0))
def test_of_many_it_is_right_within_half_a_per_cent(seed: int, exponent: float, width: float):
    values_s = 10.0**exponent * np.random.default_rng(seed).lognormal(0.0, width, EXACT + 501)
    spread = spread_of(values_s.tolist())
    median, p95 = np.percentile(values_s, [50, 95], method="inverted_cdf").tolist()
    assert spread.median == pytest.approx(median, rel=0.005, abs=1e-6)
    assert spread.p95 == pytest.approx(p95, rel=0.005, abs=1e-6)
    assert spread.largest == values_s.max()


def test_nothing_is_beyond_what_can_be_counted():
    spread = spread_of([0.0] * 1900 + [1e9] * 200)
    assert (spread.median, spread.largest) == (0.0, 1e9)
    assert spread.p95 == pytest.approx(1e6, rel=0.02)
    assert values(spread_of([0.25] * 3000)) == pytest.approx((0.25, 0.25, 0.25), rel=0.005)
