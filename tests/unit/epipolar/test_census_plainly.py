"""Codes of neighbourhoods compared bit by bit, and the mean of what differs."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.search.census import join_census
from rig.epipolar.search.window import Cameras

Map = NDArray[np.float64]
RNG = np.random.default_rng(21)
SHAPE = (9, 12)
NOISE = 6.0


def code(image: Map, v: int, u: int) -> list[int]:
    """-1, 0 or 1 of each of the 24 neighbours: darker, alike, brighter."""
    wide = np.pad(image, 2, mode="edge")
    beside = wide[v : v + 5, u : u + 5].ravel()
    signs = [int(b > image[v, u] + NOISE) - int(b < image[v, u] - NOISE) for b in beside]
    return signs[:12] + signs[13:]


def differing_bits(one: list[int], other: list[int]) -> int:
    """A sign and its opposite differ in two bits, a sign and none in one."""
    return sum(abs(a - b) for a, b in zip(one, other, strict=True))


def blurred(values: Map, radius_px: int) -> Map:
    wide = np.pad(values, radius_px, mode="reflect")
    side = 2 * radius_px + 1
    parts = [wide[y : y + SHAPE[0], x : x + SHAPE[1]] for y in range(side) for x in range(side)]
    return np.asarray(sum(parts)) / side**2


@pytest.mark.parametrize("is_row", [True, False], ids=["row", "column"])
def test_costs_of_neighbourhoods(is_row: bool):
    images = np.round(RNG.uniform(0, 60, (3, *SHAPE))).astype(np.float32)
    along, beside = np.array([0.0, 1.0, 2.0]), np.array([0.0, -0.5, 0.5])
    cameras = Cameras(along if is_row else beside, beside if is_row else along, 0)
    labels = np.array([-3.0, 0.0, 2.0, 30.0], np.float32)
    own = RNG.integers(0, 240, (SHAPE[0], 4, SHAPE[1])).astype(np.uint8)
    costs = own.copy()
    join_census(costs, images, cameras, labels, NOISE, 0.4)
    pictures = images.astype(float)
    wide = np.pad(pictures[0], 1, mode="reflect")
    tilt = 0.5 * (wide[1:-1, 2:] - wide[1:-1, :-2] if is_row else wide[2:, 1:-1] - wide[:-2, 1:-1])
    power = blurred(tilt**2, 4)
    weight = power / (power + (1.5 * NOISE) ** 2)
    codes = {(i, v, u): code(pictures[i], v, u) for i in range(3) for v, u in np.ndindex(SHAPE)}
    for k, label in enumerate(labels):
        plane = np.full(SHAPE, 24.0)
        for v, u in np.ndindex(SHAPE):
            places = [
                (i, v - round(label * cameras.y_steps[i]), u - round(label * cameras.x_steps[i]))
                for i in (1, 2)
            ]
            bits = [differing_bits(codes[0, v, u], codes[p]) for p in places if p in codes]
            if bits:
                plane[v, u] = np.mean(bits)
        differs = weight * np.minimum(10 * blurred(plane, 1), 240)
        expected = 0.6 * own[:, k] + 0.4 * differs
        assert np.abs(costs[:, k] - np.floor(expected)).max() <= 1
        assert np.mean(costs[:, k] != np.floor(expected)) < 0.05
