"""What the outermost view finds in the same costs, pixel by pixel; and the filling of the rest."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.search.cross_check import fill_unshared, shared_slopes
from rig.epipolar.search.window import Cameras

RNG = np.random.default_rng(8)


@pytest.mark.parametrize(
    ("x_steps", "y_steps"),
    [
        ((0.0, 1.0), (0.0, 0.0)),
        ((0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        ((0.0, 0.0), (0.0, -1.0)),
        ((0.0, 0.25), (0.0, 0.0)),
    ],
)
def test_slopes_are_shared_where_the_other_view_finds_them(
    x_steps: tuple[float, ...], y_steps: tuple[float, ...]
):
    cameras = Cameras(np.array(x_steps), np.array(y_steps), 0)
    apart_px = 4.0 if x_steps[-1] == 0.25 else 1.0
    labels = apart_px * np.arange(-2, 5, dtype=np.float32)
    height, width = 9, 11
    total = RNG.integers(0, 30, (height, len(labels), width)).astype(np.int16)
    slope = apart_px * RNG.uniform(-2.4, 4.4, (height, width)).astype(np.float32)
    found = shared_slopes(total, labels, slope, cameras)
    x_step, y_step = x_steps[-1], y_steps[-1]
    best: dict[tuple[int, int], tuple[int, int, int]] = {}
    for v, k, u in np.ndindex(total.shape):
        place = v - round(float(labels[k]) * y_step), u - round(float(labels[k]) * x_step)
        here = int(total[v, k, u]), v, k  # of equal costs the first that was looked at
        best[place] = min(best.get(place, here), here)
    limit = 0.75 / np.hypot(x_step, y_step) + 0.5 * apart_px
    expected, seen, apart = (np.zeros((height, width)) for _ in range(3))
    for v, u in np.ndindex(height, width):
        m = float(slope[v, u])
        place = round(v - m * y_step), round(u - m * x_step)
        inside = 0 <= place[0] < height and 0 <= place[1] < width
        if inside and place in best:
            gap = abs(labels[best[place][2]] - m)
            expected[v, u] = gap <= limit
            apart[v, u] = 0.0 if gap <= limit else gap - 0.5 * apart_px
            beside = [(place[0] + dy, place[1] + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
            beside = [p for p in beside if 0 <= p[0] < height and 0 <= p[1] < width and p in best]
            seen[v, u] = min(abs(labels[best[p][2]] - m) for p in beside) <= limit
    assert np.array_equal(found.shared, expected)
    assert np.array_equal(found.seen, seen)
    assert found.apart_px == pytest.approx(apart, abs=1e-5)
    assert 0.05 < expected.mean() < seen.mean() < 0.95


def test_borders_of_the_picture_are_shared_too():
    cameras = Cameras(np.array([0.0, 1.0]), np.zeros(2), 0)
    total = np.ones((2, 3, 2), np.int16)
    total[:, 1] = 0
    found = shared_slopes(
        total, np.arange(3, dtype=np.float32), np.ones((2, 2), np.float32), cameras
    )
    assert found.shared.tolist() == [[False, True], [False, True]]
    upward = Cameras(np.zeros(2), np.array([0.0, 1.0]), 0)
    found = shared_slopes(
        total, np.arange(3, dtype=np.float32), np.ones((2, 2), np.float32), upward
    )
    assert found.shared.tolist() == [[False, False], [True, True]]


SLOPES = np.array([[5.0, 1.0, 2.0, 3.0, 4.0], [7.0, 8.0, 9.0, 6.0, 5.0]], np.float32)
SHARED = np.array([[0, 1, 0, 0, 1], [0, 0, 0, 0, 0]], np.bool_)
FILLED = [[1.0, 1.0, 1.0, 1.0, 4.0], [7.0, 8.0, 9.0, 6.0, 5.0]]


def filled(slopes: NDArray[np.float32], shared: NDArray[np.bool_], x: float, y: float):
    return fill_unshared(slopes, shared, Cameras(np.array([0.0, x]), np.array([0.0, y]), 0))


def test_what_is_not_shared_takes_the_farther_slope_beside_it_along_the_line():
    assert filled(SLOPES, SHARED, 1.0, 0.0).tolist() == FILLED
    assert filled(SLOPES, SHARED, -1.0, 1.0).tolist() == FILLED
    assert filled(SLOPES.T, SHARED.T, 0.5, 1.0).T.tolist() == FILLED
