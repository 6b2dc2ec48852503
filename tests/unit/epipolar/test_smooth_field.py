"""Smooth fields: polynomials come back exactly, outliers and empty corners do no harm."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rig.epipolar.mending.smooth_field import (
    HELD,
    TERMS,
    SmoothField,
    coarse_rms,
    fit_field,
    is_worth_it,
    normal_equations,
    values_everywhere,
)

Array = NDArray[np.float64]

SHAPE = (90, 120)
EXPECTED = 3.0
seeds = st.integers(0, 10_000)


def places(seed: int, count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0, SHAPE[1] - 1, count), rng.uniform(0, SHAPE[0] - 1, count)


def polynomial(seed: int, degree: int, x_px: Array, y_px: Array) -> Array:
    """Powers, not the products that the module is built of, of the coordinates, size about 1."""
    rng = np.random.default_rng(seed)
    s, t = 2.0 * x_px / (SHAPE[1] - 1) - 1.0, 2.0 * y_px / (SHAPE[0] - 1) - 1.0
    total = np.zeros_like(s)
    for n in range(degree + 1):
        for i in range(n + 1):
            total += rng.uniform(-1.0, 1.0) / (1.0 + n) * s**i * t ** (n - i)
    return total


def fitted(x_px: Array, y_px: Array, values: Array, sigma: float = 0.01) -> SmoothField:
    return fit_field(x_px, y_px, values, np.full(len(values), sigma), SHAPE, EXPECTED)


@settings(deadline=None, max_examples=25)
@given(seed=seeds, degree=st.integers(0, 4))
def test_polynomials_up_to_the_fourth_degree_are_recovered(seed: int, degree: int) -> None:
    x, y = places(seed, 400)
    noise = 0.01 * np.random.default_rng(seed + 1).standard_normal(400)
    found = fitted(x, y, polynomial(seed, degree, x, y) + noise)
    asked = places(seed + 2, 300)
    error = found.at(*asked) - polynomial(seed, degree, *asked)
    assert np.abs(error).max() < 0.03
    assert found.scatter == pytest.approx(0.01, rel=0.25)


@settings(deadline=None, max_examples=25)
@given(seed=seeds, height=st.integers(1, 30), width=st.integers(1, 30))
def test_every_pixel_has_the_value_of_its_place(seed: int, height: int, width: int) -> None:
    coefficients = np.random.default_rng(seed).standard_normal(TERMS)
    field = SmoothField(coefficients, (height, width), np.eye(TERMS), 0.0)
    rows, columns = np.mgrid[0:height, 0:width].astype(float)
    at = field.at(columns.ravel(), rows.ravel()).reshape(height, width)
    assert field.everywhere() == pytest.approx(at, abs=2e-5)
    assert np.array_equal(field.everywhere(), values_everywhere(coefficients, (height, width)))


def test_sigma_is_that_of_the_values() -> None:
    asked, errors, sigmas = places(9, 50), [], []
    for seed in range(40):
        x, y = places(seed, 200)
        noise = 0.05 * np.random.default_rng(seed + 100).standard_normal(200)
        found = fitted(x, y, polynomial(3, 4, x, y) + noise, sigma=0.05)
        errors.append(found.at(*asked) - polynomial(3, 4, *asked))
        sigmas.append(found.sigma_at(*asked))
    ratio = np.sqrt(np.mean((np.array(errors) / np.array(sigmas)) ** 2))
    assert 0.8 < float(ratio) < 1.5


@settings(deadline=None, max_examples=20)
@given(seed=seeds)
def test_a_fifth_of_wrong_measurements_do_no_harm(seed: int) -> None:
    x, y = places(seed, 500)
    rng = np.random.default_rng(seed + 1)
    values = polynomial(seed, 3, x, y) + 0.02 * rng.standard_normal(500)
    wrong = rng.permutation(500) < 100
    values[wrong] += rng.uniform(-3.0, 5.0, 100)
    found = fitted(x, y, values, sigma=0.02)
    asked = 5.0 + 0.9 * places(seed + 2, 300)[0], 5.0 + 0.85 * places(seed + 2, 300)[1]
    error = found.at(*asked) - polynomial(seed, 3, *asked)
    assert np.sqrt((error**2).mean()) < 0.03


@settings(deadline=None, max_examples=25)
@given(seed=seeds, share=st.floats(0.1, 0.5))
def test_a_field_does_not_run_away_where_nothing_was_measured(seed: int, share: float) -> None:
    """Measured in one corner only: elsewhere no value beyond three sigma of the prior."""
    x, y = places(seed, 200)
    x, y = share * x, share * y
    values = 0.5 + 0.3 * np.random.default_rng(seed + 1).standard_normal(200)
    found = fitted(x, y, values, sigma=0.3)
    rows, columns = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)
    most = 1.6 * EXPECTED  # in a corner all products are 1: root of the sum of 0.36^n (n + 1)
    values_there = found.at(columns.ravel(), rows.ravel())
    assert (np.abs(values_there) < 3.0 * most).all()
    sigma = found.sigma_at(columns.ravel(), rows.ravel())
    assert (sigma < most).all()
    assert sigma[-1] > 10 * sigma[0]


def test_without_measurements_the_field_is_zero_and_as_unsure_as_the_prior() -> None:
    nothing = np.zeros(0)
    found = fit_field(nothing, nothing, nothing, nothing, SHAPE, EXPECTED)
    assert not found.everywhere().any()
    assert np.diag(found.covariance) == pytest.approx((EXPECTED * HELD) ** 2)


def test_noise_is_not_worth_a_field_and_a_field_is() -> None:
    x, y = places(1, 400)
    worth: list[bool] = []
    for seed in range(30):
        noise = 0.3 * np.random.default_rng(seed).standard_normal(400)
        for values in (noise, noise + 0.3 * polynomial(5, 2, x, y) + 0.3):
            sigmas = np.full(400, 0.3)
            worth.append(is_worth_it(x, y, values, sigmas, SHAPE, EXPECTED))
    assert not any(worth[::2])
    assert all(worth[1::2])


def test_few_measurements_are_never_worth_a_field() -> None:
    x, y = places(1, TERMS)
    sigmas = np.full(TERMS, 0.01)
    assert not is_worth_it(x, y, np.full(TERMS, 2.0), sigmas, SHAPE, EXPECTED)


def test_the_size_at_a_glance_is_that_of_the_field_not_of_the_noise() -> None:
    x, y = places(2, 1600)
    noise = np.random.default_rng(3).standard_normal(1600)
    assert coarse_rms(x, y, noise, SHAPE) < 0.25
    assert coarse_rms(x, y, 2.0 + noise, SHAPE) == pytest.approx(2.0, abs=0.1)
    tilt = 2.0 * x / (SHAPE[1] - 1) - 1.0
    assert coarse_rms(x, y, tilt, SHAPE) == pytest.approx(0.56, abs=0.06)
    assert coarse_rms(x[:4], y[:4], noise[:4], SHAPE) == 0.0


@settings(deadline=None, max_examples=20)
@given(seed=seeds, count=st.integers(0, 200))
def test_normal_equations_are_those_of_the_whole_design(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    design, weight = rng.standard_normal((count, 5)), rng.random(count)
    values = rng.standard_normal(count)
    normal, right = normal_equations(design, weight, values)
    assert normal == pytest.approx(design.T @ (design * weight[:, None]), abs=1e-9)
    assert right == pytest.approx(design.T @ (weight * values), abs=1e-9)
