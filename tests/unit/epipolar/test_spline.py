"""Smoothed splines along lines, against closed form."""

import numpy as np
import pytest

from rig.epipolar.spline import sample_lines, spline_coefficients

X, Y = np.meshgrid(np.arange(64.0), np.arange(48.0))


def wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 100 + 50 * np.sin(0.2 * x + 0.12 * y)


def straight(
    x: np.ndarray, y: np.ndarray, views: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points (N,) in `views` pictures of the common frame that no slope moves."""
    places = np.repeat(np.stack([x, y])[None], views, axis=0)
    return (
        places,
        np.zeros_like(places),
        np.zeros(len(x)),
        np.repeat(np.eye(2)[None], views, axis=0),
    )


def test_a_smoothed_wave_is_sampled_between_pixels_with_its_gradient():
    coefficients = spline_coefficients(wave(X, Y), 1.0)[None]
    x, y = np.linspace(20, 40, 33), np.linspace(18, 30, 33)
    value, gradient = sample_lines(coefficients, *straight(x, y))
    damping = np.exp(-(0.2**2 + 0.12**2) / 2)
    truth = 100 + damping * (wave(x, y) - 100)
    rate = damping * 50 * np.cos(0.2 * x + 0.12 * y)
    assert value[0] == pytest.approx(truth, abs=2e-3)
    assert gradient[0] == pytest.approx(0.2 * rate, abs=5e-3)
    assert gradient[1] == pytest.approx(0.12 * rate, abs=5e-3)


def test_a_slope_moves_the_points_at_their_rates():
    coefficients = np.stack([spline_coefficients(wave(X, Y), 1.0)] * 3)
    x, y = np.array([30.0]), np.array([24.0])
    places, rates, change, turns = straight(x, y, views=3)
    rates[1, 0], rates[2, 1] = -1.0, -2.0
    value, _ = sample_lines(coefficients, places, rates, change + 1.5, turns)
    shifted = [
        sample_lines(coefficients[:1], *straight(x + dx, y + dy))[0][0, 0]
        for dx, dy in ((0.0, 0.0), (-1.5, 0.0), (0.0, -3.0))
    ]
    assert value[:, 0] == pytest.approx(shifted)


def test_the_gradient_is_that_of_the_common_frame():
    """A picture that is turned by a quarter shows a rise to the right as one downwards."""
    coefficients = spline_coefficients(wave(X, Y), 1.0)[None]
    places, rates, change, _ = straight(np.array([30.0]), np.array([24.0]))
    _, plain = sample_lines(coefficients, places, rates, change, np.eye(2)[None])
    quarter = np.array([[[0.0, -1.0], [1.0, 0.0]]])
    _, turned = sample_lines(coefficients, places, rates, change, quarter)
    assert turned[:, 0] == pytest.approx([plain[1, 0], -plain[0, 0]])


def test_a_flat_picture_stays_flat_up_to_the_border():
    assert spline_coefficients(np.full((20, 20), 77.0), 1.0) == pytest.approx(77.0, rel=1e-6)
