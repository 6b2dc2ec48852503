"""Resampling beside Lagrange's polynomial, and lines through splines beside another library."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from rig.epipolar.resample import Resampler
from rig.epipolar.spline import sample_lines, spline_coefficients

RNG = np.random.default_rng(51)
RAW = [
    RNG.uniform(0, 200, (9, 11)).astype(np.float32),
    RNG.uniform(0, 200, (12, 8)).astype(np.float32),
]


def lagrange(part: float) -> NDArray[np.float64]:
    """Weights of the pixels -2..3 for a place between 0 and 1."""
    nodes = range(-2, 4)
    return np.array(
        [np.prod([(part - i) / (k - i) for i in nodes if i != k]) for k in nodes], np.float64
    )


def plain(raw: NDArray[np.float32], x: float, y: float) -> float:
    rows, columns = raw.shape
    x, y = np.clip(np.nan_to_num(x), 0, columns - 1), np.clip(np.nan_to_num(y), 0, rows - 1)
    wide = np.pad(raw.astype(float), 3, mode="edge")
    column, row = int(np.floor(x)), int(np.floor(y))
    six = wide[row + 1 : row + 7, column + 1 : column + 7]
    return float(lagrange(y - row) @ six @ lagrange(x - column))


def test_every_pixel_is_a_polynomial_through_six_neighbours_each_way():
    places = []
    for raw in RAW:
        rows, columns = np.mgrid[0:7, 0:10].astype(float)
        x = 0.9 * columns + 0.31 + 0.2 * rows - 1.0
        y = rows * 1.3 + 0.07 * columns - 0.4
        x[2], y[2] = columns[2] * 1.0, 4.0  # one run of whole pixels
        x[3, 4], y[4, 5] = np.nan, np.nan
        x[5, :4], y[5, :4] = [0, raw.shape[1] - 1, 0, raw.shape[1] - 1], [0, 0, raw.shape[0] - 1, 2]
        places.append(np.stack([x, y], axis=-1))
    resampler = Resampler(places, [raw.shape for raw in RAW])
    found = resampler(RAW)
    for view, raw in enumerate(RAW):
        for v, u in np.ndindex(7, 10):
            x, y = places[view][v, u]
            assert found[view, v, u] == pytest.approx(plain(raw, x, y), abs=2e-2)
            inside = 0 <= x <= raw.shape[1] - 1 and 0 <= y <= raw.shape[0] - 1
            assert resampler.valid[view, v, u] == inside
    assert np.array_equal(resampler(RAW), found)
    assert not resampler.valid.flags.writeable


def turned(degrees: float) -> NDArray[np.float64]:
    a = np.radians(degrees)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), 1.1 * np.cos(a)]])


def through(
    picture: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    return map_coordinates(picture, [y, x], order=3, mode="mirror")


@pytest.mark.parametrize("smooth_px", [0.0, 0.9])
def test_lines_through_smoothed_pictures(smooth_px: float):
    pictures = RNG.uniform(0, 200, (2, 24, 30))
    coefficients = np.stack([spline_coefficients(one, smooth_px) for one in pictures])
    places = RNG.uniform(8, 15, (2, 2, 40))
    rates = RNG.uniform(-2, 2, (2, 2, 40))
    change = RNG.uniform(-1, 1, 40)
    turns = np.stack([turned(20), turned(-35)])
    value, gradient = sample_lines(coefficients, places, rates, change, turns)
    expected = np.zeros((2, 40))
    e = 1e-4
    for view in range(2):
        soft = pictures[view]
        if smooth_px:
            soft = gaussian_filter(soft, smooth_px, mode="mirror", truncate=6)
        x, y = places[view] + change * rates[view]
        assert value[view] == pytest.approx(through(soft, x, y), abs=0.02)
        by_x = (through(soft, x + e, y) - through(soft, x - e, y)) / (2 * e)
        by_y = (through(soft, x, y + e) - through(soft, x, y - e)) / (2 * e)
        expected[0] += (by_x * turns[view, 0, 0] + by_y * turns[view, 1, 0]) / 2
        expected[1] += (by_x * turns[view, 0, 1] + by_y * turns[view, 1, 1]) / 2
    assert gradient == pytest.approx(expected, abs=0.05)
