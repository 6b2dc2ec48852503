"""Smoothed splines along lines, against closed form."""

import numpy as np
import pytest

from rig.epipolar.spline import sample_lines, spline_coefficients

X, Y = np.meshgrid(np.arange(64.0), np.arange(48.0))


def wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 100 + 50 * np.sin(0.2 * x + 0.12 * y)


def beside(views: int, points: int) -> np.ndarray:
    return np.zeros((views, 2, points))


def test_a_smoothed_wave_is_sampled_between_pixels_with_its_gradient():
    coefficients = spline_coefficients(wave(X, Y), 1.0)[None]
    x, y = np.linspace(20, 40, 33), np.linspace(18, 30, 33)
    value, gradient = sample_lines(
        coefficients, x, y, np.zeros(33), np.zeros(1), np.zeros(1), beside(1, 33)
    )
    damping = np.exp(-(0.2**2 + 0.12**2) / 2)
    truth = 100 + damping * (wave(x, y) - 100)
    rate = damping * 50 * np.cos(0.2 * x + 0.12 * y)
    assert value[0] == pytest.approx(truth, abs=2e-3)
    assert gradient[0] == pytest.approx(0.2 * rate, abs=5e-3)
    assert gradient[1] == pytest.approx(0.12 * rate, abs=5e-3)


def test_lines_run_against_the_view_position():
    coefficients = np.stack([spline_coefficients(wave(X, Y), 1.0)] * 3)
    at = (np.array([30.0]), np.array([24.0]))
    steps = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 2.0])
    value, _ = sample_lines(coefficients, *at, np.array([1.5]), *steps, beside(3, 1))
    shifted = [
        sample_lines(coefficients[:1], x, y, np.zeros(1), np.zeros(1), np.zeros(1), beside(1, 1))[
            0
        ][0, 0]
        for x, y in (at, (at[0] - 1.5, at[1]), (at[0], at[1] - 3.0))
    ]
    assert value[:, 0] == pytest.approx(shifted)


def test_a_flat_picture_stays_flat_up_to_the_border():
    assert spline_coefficients(np.full((20, 20), 77.0), 1.0) == pytest.approx(77.0, rel=1e-6)


def test_a_picture_beside_its_line_is_found_there():
    coefficients = spline_coefficients(wave(X, Y), 1.0)[None]
    x, y = np.array([30.0]), np.array([24.0])
    off = np.array([[[1.25], [-0.5]]])
    value, _ = sample_lines(coefficients, x, y, np.zeros(1), np.zeros(1), np.zeros(1), off)
    there, _ = sample_lines(
        coefficients, x + 1.25, y - 0.5, np.zeros(1), np.zeros(1), np.zeros(1), beside(1, 1)
    )
    assert value[0, 0] == there[0, 0]
