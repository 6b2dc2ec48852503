"""The fit of a drift beside plain sums over windows; and how much of it is believed."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.optimize import brentq

from rig.epipolar.drift_fit import drift_of_all, fit_drift
from rig.epipolar.sampling import pad
from rig.epipolar.search.window import Cameras

X_STEPS = np.array([-1.0, 0.0, 1.0, 0.0, 1.0, 2.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, 1.5, -1.0, 0.0])
REFERENCE, STRIDE, RADIUS = 1, 3, 2
SHAPE = (25, 29)
GATE_PX, DOUBT, LEAST_TILT = 0.9, 40.0, 3.0
RNG = np.random.default_rng(41)
ROWS, COLUMNS = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)
DRIFT = (9.0, -7.0)


def texture(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return 110 + 30 * np.sin(0.7 * x + 0.3 * y) + 25 * np.cos(0.5 * y - 0.4 * x)


def scene() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    slope = np.where(COLUMNS < 15, 0.35, -0.3) + RNG.normal(0, 0.1, SHAPE)
    grey = [
        texture(COLUMNS + 0.3 * x, ROWS + 0.3 * y) + DRIFT[0] * x + DRIFT[1] * y
        + RNG.normal(0, 1.0, SHAPE)
        for x, y in zip(X_STEPS, Y_STEPS, strict=True)
    ]  # fmt: skip
    return np.stack(grey).astype(np.float32), slope.astype(np.float32)


def sampled(image: NDArray[np.float32], x: float, y: float) -> float:
    return float(map_coordinates(image.astype(float), [[y], [x]], order=3, mode="mirror")[0])


def point_sums(
    images: NDArray[np.float32], v: int, u: int, m: float, before: NDArray[np.float32] | None
) -> NDArray[np.float64]:
    """Sums of xx xy yy xj yj xg yg jj jg over the views of a point."""
    centre, total, e = float(images[REFERENCE, v, u]), np.zeros(9), 1e-3
    for i, (sx, sy) in enumerate(zip(X_STEPS, Y_STEPS, strict=True)):
        x, y = u - m * sx, v - m * sy
        if i == REFERENCE or not (0 <= x <= SHAPE[1] - 1 and 0 <= y <= SHAPE[0] - 1):
            continue
        g = sampled(images[i], x, y) - centre
        j = (sampled(images[i], x - e * sx, y - e * sy)
             - sampled(images[i], x + e * sx, y + e * sy)) / (2 * e)  # fmt: skip
        known = 0.0 if before is None else sx * before[0, v, u] + sy * before[1, v, u]
        w = 1 / (1 + ((g - known) / DOUBT) ** 2)
        total += w * np.array(
            [sx * sx, sx * sy, sy * sy, sx * j, sy * j, sx * g, sy * g, j * j, j * g]
        )
    return total


def plain_drift(
    images: NDArray[np.float32], slope: NDArray[np.float32], before: NDArray[np.float32] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Drift and variance of every point of the grid, before anything is held back."""
    rows, columns = (range(STRIDE // 2, side, STRIDE) for side in SHAPE)
    points = {
        (i, k): point_sums(images, v, u, float(slope[v, u]), before)
        for i, v in enumerate(rows) for k, u in enumerate(columns)
    }  # fmt: skip
    drift, variance = np.zeros((2, 2, len(rows), len(columns)))
    for i, k in points:
        here = float(slope[rows[i], columns[k]])
        near = []
        for dy in range(-RADIUS, RADIUS + 1):
            for dx in range(-RADIUS, RADIUS + 1):
                if dy**2 + dx**2 <= (RADIUS + 0.5) ** 2 and (i + dy, k + dx) in points:
                    apart = (float(slope[rows[i + dy], columns[k + dx]]) - here) / GATE_PX
                    gate = max(1 - apart**2, 0) ** 2 * (1 - (dy**2 + dx**2) / (RADIUS + 1) ** 2)
                    near.append((gate, points[i + dy, k + dx]))
        xx, xy, yy, xj, yj, xg, yg, jj, jg = np.sum([gate * one for gate, one in near], axis=0)
        jj += LEAST_TILT**2
        tiny = 1e-4 * (xx + yy) + 1e-9
        normal = np.array([[xx - xj * xj / jj + tiny, xy - xj * yj / jj],
                           [xy - xj * yj / jj, yy - yj * yj / jj + tiny]])  # fmt: skip
        found = np.linalg.solve(normal, [xg - xj * jg / jj, yg - yj * jg / jj])
        drift[:, i, k] = found
        for axis, (g, s) in enumerate(((5, 0), (6, 2))):
            scatter = sum(gate**2 * (one[g] - found[axis] * one[s]) ** 2 for gate, one in near)
            variance[axis, i, k] = 5 * scatter / normal[axis, axis] ** 2
    return drift, variance


def believed(found: NDArray[np.float64], chance: NDArray[np.float64]) -> float:
    """Variance of a drift that makes chance and drift together fit the ninth tenth of it."""

    def excess(there: float) -> float:
        return float(np.quantile(found**2 / (chance + there + 1e-12), 0.9)) - 2.71

    return brentq(excess, 0.0, float((found**2).max())) if excess(0.0) > 2.71 else 0.0


@pytest.mark.parametrize("is_known", [False, True], ids=["new", "known"])
def test_a_drift_is_the_window_s_least_squares_fit_held_back_by_chance(is_known: bool):
    images, slope = scene()
    before = RNG.normal(0, 3, (2, *SHAPE)).astype(np.float32) if is_known else None
    splines = pad(images, X_STEPS, Y_STEPS)
    told = fit_drift(
        splines, images[REFERENCE], slope, before, Cameras(X_STEPS, Y_STEPS, REFERENCE),
        stride_px=STRIDE, radius=RADIUS, gate_px=GATE_PX, doubt_levels=DOUBT,
        least_tilt_levels=LEAST_TILT,
    )  # fmt: skip
    drift, variance = plain_drift(images, slope, before)
    assert told is not None
    for axis in (0, 1):
        there = believed(drift[axis], variance[axis])
        share = there / (there + variance[axis])
        assert there > 1
        assert told[0][axis] == pytest.approx(share * drift[axis], rel=0.01, abs=0.02)
        assert told[1][axis] == pytest.approx(share * variance[axis], rel=0.02, abs=0.02)


def test_a_drift_along_rows_only_leaves_the_columns_without():
    images, slope = scene()
    in_row = np.flatnonzero(Y_STEPS == 0)
    cameras = Cameras(X_STEPS[in_row], np.zeros(len(in_row)), 1)
    splines = pad(images[in_row], cameras.x_steps, cameras.y_steps)
    told = fit_drift(
        splines, images[REFERENCE], slope, None, cameras, stride_px=STRIDE, radius=RADIUS,
        gate_px=GATE_PX, doubt_levels=DOUBT, least_tilt_levels=LEAST_TILT,
    )  # fmt: skip
    assert told is not None
    assert not told[0][1].any()
    assert np.median(told[0][0]) == pytest.approx(DRIFT[0], abs=2.5)


def test_no_drift_is_an_empty_one():
    assert drift_of_all(None).shape == (2, 0, 0)
    some = np.ones((2, 3, 4), np.float32)
    assert drift_of_all(some) is some
