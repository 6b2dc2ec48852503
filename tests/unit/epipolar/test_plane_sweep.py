"""Costs of the sweep, pixel by pixel, as its description says; and of the search around slopes."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from rig.epipolar.search.halves import COST_MAX, assign_halves
from rig.epipolar.search.narrow import narrow_costs
from rig.epipolar.search.plane_sweep import average, sweep_costs

Map = NDArray[np.float64]
Shown = Callable[[int, int, int, float], float | None]
"""What a view shows of row, column at a slope; None where it does not show it."""

X_STEPS = np.array([-1.0, 0.0, 1.5, 0.0, 0.5, 2.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.0, 1.0, 0.25, 2.0])
REFERENCE = 1
SHAPE = (8, 11)
TRUNCATION = 37.0
RNG = np.random.default_rng(6)
IMAGES = RNG.integers(0, 200, (7, *SHAPE)).astype(np.float32)
DRIFT = RNG.uniform(-6.0, 6.0, (2, *SHAPE)).astype(np.float32)


def pixel_costs(shown: Shown, against: Callable[[int, int, int], float], slope: Map) -> list[Map]:
    """Mean truncated difference of each half, (H, W); infinite where none of its views shows it."""
    half = assign_halves(X_STEPS, Y_STEPS)
    means: list[Map] = []
    for h in range(4):
        cost = np.full(SHAPE, np.inf)
        for v, u in np.ndindex(SHAPE):
            m = float(slope[v, u])
            seen = [(i, shown(i, v, u, m)) for i in np.flatnonzero(half == h).tolist()]
            found = [
                min(abs(grey - against(i, v, u)), TRUNCATION)
                for i, grey in seen
                if grey is not None
            ]
            if found:
                cost[v, u] = sum(found) / len(found)
        means.append(cost)
    return means


def joined(means: list[Map]) -> Map:
    """Sums over 3 x 3 pixels, the better half of every axis a little raised, both axes added."""
    wide = [np.pad(one, 1, mode="edge") for one in means]
    nine = [
        sum(one[y : y + SHAPE[0], x : x + SHAPE[1]] for y in range(3) for x in range(3))
        for one in wide
    ]
    full = 9 * TRUNCATION
    axes: list[Map] = []
    for one, other in ((nine[0], nine[1]), (nine[2], nine[3])):
        low = np.minimum(one, other)
        with np.errstate(invalid="ignore"):
            gap = 0.5 * np.abs(np.asarray(one) - np.asarray(other))
        axes.append(np.where(gap <= full, low + np.minimum(gap, 0.03 * full), low))
    row = np.where(np.isinf(axes[0]), axes[1], axes[0])
    column = np.where(np.isinf(axes[1]), axes[0], axes[1])
    return np.minimum(COST_MAX / (2 * full) * (row + column), COST_MAX)


def bilinear(i: int, v: int, u: int, slope: float) -> float | None:
    x, y = u - slope * X_STEPS[i], v - slope * Y_STEPS[i]
    x0, y0 = int(np.floor(x)), int(np.floor(y))
    fx, fy = x - x0, y - y0
    x1, y1 = x0 + (fx > 0), y0 + (fy > 0)
    if not (x0 >= 0 and x1 < SHAPE[1] and y0 >= 0 and y1 < SHAPE[0]):
        return None
    at = IMAGES[i].astype(float)
    top = at[y0, x0] * (1 - fx) + at[y0, x1] * fx
    return float(top * (1 - fy) + (at[y1, x0] * (1 - fx) + at[y1, x1] * fx) * fy)


LABELS_PX = np.array([-2.5, -1.0, 0.0, 0.75, 3.0], np.float32)


def plain(v: int, u: int) -> float:
    return float(IMAGES[REFERENCE, v, u])


def lit(i: int, v: int, u: int) -> float:
    return plain(v, u) + float(X_STEPS[i] * DRIFT[0, v, u] + Y_STEPS[i] * DRIFT[1, v, u])


def of_own_axis(i: int, v: int, u: int) -> float:
    return plain(v, u) + (5.0 if abs(X_STEPS[i]) >= abs(Y_STEPS[i]) else -9.0)


CENTRES = np.stack([IMAGES[REFERENCE] + 5, IMAGES[REFERENCE] - 9])


@pytest.mark.parametrize(
    ("against", "centres", "drift"),
    [
        (lambda i, v, u: plain(v, u), None, None),
        (lit, None, DRIFT),
        (of_own_axis, CENTRES, None),
    ],
    ids=["grey", "drifting", "texture"],
)
def test_costs_of_a_sweep(
    against: Callable[[int, int, int], float],
    centres: NDArray[np.float32] | None,
    drift: NDArray[np.float32] | None,
):
    costs = sweep_costs(IMAGES, X_STEPS, Y_STEPS, REFERENCE, LABELS_PX, TRUNCATION, centres, drift)
    for k, label in enumerate(LABELS_PX):
        expected = joined(pixel_costs(bilinear, against, np.full(SHAPE, float(label))))
        assert np.abs(costs[:, k] - np.floor(expected)).max() <= 1
        assert np.mean(costs[:, k] != np.floor(expected)) < 0.03


def cubic(i: int, v: int, u: int, slope: float) -> float | None:
    x, y = u - slope * X_STEPS[i], v - slope * Y_STEPS[i]
    if not (0 <= x <= SHAPE[1] - 1 and 0 <= y <= SHAPE[0] - 1):
        return None
    at = IMAGES[i].astype(float)
    return float(map_coordinates(at, [[y], [x]], order=3, mode="mirror")[0])


def test_costs_around_a_hypothesis_are_those_of_every_pixels_own_slope():
    centre = RNG.uniform(-1.5, 1.5, SHAPE).astype(np.float32)
    offsets = np.array([-0.75, 0.0, 1.25], np.float32)
    costs = narrow_costs(IMAGES, X_STEPS, Y_STEPS, REFERENCE, centre, offsets, TRUNCATION)
    for k, offset in enumerate(offsets):
        means = pixel_costs(cubic, lambda i, v, u: plain(v, u), (centre + offset).astype(float))
        expected = joined(means)
        assert np.abs(costs[:, k] - np.floor(expected)).max() <= 1


def test_the_average_of_costs_is_half_of_their_sum():
    one = np.array([[[10, 0], [240, 8]]], np.uint8)
    average(one, np.array([[[30, 240], [240, 0]]], np.uint8))
    assert one.tolist() == [[[20, 120], [240, 4]]]
