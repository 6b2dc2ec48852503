"""Which side of a jump a pixel takes, beside sums over its lines and neighbours, one by one."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from rig.epipolar.sampling import pad
from rig.epipolar.scales import Scales
from rig.epipolar.search.halves import assign_halves
from rig.epipolar.search.sides import choose_sides
from rig.epipolar.search.window import Cameras

X_STEPS = np.array([-1.0, 0.0, 1.0, 0.0, 0.0, 2.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.0, 1.5, 0.5])
SHAPE, REFERENCE = (15, 19), 1
SCALES = Scales(noise=4.0, texture=20.0)
STEP_PX = 0.4 / np.hypot(2.0, 0.5)


def window_of(v: int, u: int, radius_px: int) -> tuple[slice, slice]:
    return (
        slice(max(v - radius_px, 0), min(v + radius_px + 1, SHAPE[0])),
        slice(max(u - radius_px, 0), min(u + radius_px + 1, SHAPE[1])),
    )


def sides_of(slope: NDArray[np.float64], v: int, u: int) -> tuple[float, float]:
    """Weighted mean slope of the farther and of the nearer neighbours."""
    part = window_of(v, u, 3)
    near_by, (rows, columns) = slope[part], np.mgrid[part]
    middle = 0.5 * (near_by.min() + near_by.max())
    weight = 1 / (1 + (rows - v) ** 2 + (columns - u) ** 2)
    far = near_by < middle
    one, other = (float(np.average(near_by[s], weights=weight[s])) for s in (far, ~far))
    return one, other


def differences(
    images: NDArray[np.float32], v: int, u: int, m: float, drift: NDArray[np.float32] | None
) -> list[list[float]]:
    """Of each half: what its views differ by, where they show the point."""
    half, found = assign_halves(X_STEPS, Y_STEPS), [[], [], [], []]
    for i in np.flatnonzero(half >= 0):
        x, y = u - m * X_STEPS[i], v - m * Y_STEPS[i]
        if 0 <= x <= SHAPE[1] - 1 and 0 <= y <= SHAPE[0] - 1:
            told = map_coordinates(images[i].astype(float), [[y], [x]], order=3, mode="mirror")[0]
            lit = float(images[REFERENCE, v, u])
            if drift is not None:
                lit += X_STEPS[i] * drift[0, v, u] + Y_STEPS[i] * drift[1, v, u]
            found[half[i]].append(min(abs(told - lit), 3 * SCALES.doubt))
    return found


def preference(near: list[list[float]], far: list[list[float]]) -> float:
    """By how much the nearer slope fits worse: all views against the better half of each axis."""
    axes = [
        min(np.mean(one) for one in far[2 * k : 2 * k + 2] if one)
        for k in (0, 1) if any(far[2 * k : 2 * k + 2])
    ]  # fmt: skip
    every = [d for half in near for d in half]
    return float(np.mean(every) - np.mean(axes)) if every and axes else 0.0


@pytest.mark.parametrize("is_drifting", [False, True], ids=["still", "drifting"])
def test_pixels_near_jumps_take_the_side_that_their_lines_prefer(is_drifting: bool):
    rng = np.random.default_rng(1)
    images = rng.uniform(80, 130, (6, *SHAPE)).astype(np.float32)
    # Below, all of it lies on the nearer surface.
    rows, columns = np.mgrid[11 : SHAPE[0], 0 : SHAPE[1]].astype(float)
    for image, x, y in zip(images, X_STEPS, Y_STEPS, strict=True):
        image[11:] = 105 + 25 * np.sin(1.1 * (columns + 1.5 * x)) * np.cos(0.9 * (rows + 1.5 * y))
    slope = np.where(np.arange(SHAPE[1]) < 9, -1.2, 1.5) + rng.normal(0, 0.02, SHAPE)
    slope = slope.astype(np.float32)
    movable = rng.random(SHAPE) < 0.8
    drift = rng.uniform(-4, 4, (2, *SHAPE)).astype(np.float32) if is_drifting else None
    found = choose_sides(
        pad(images, X_STEPS, Y_STEPS), images[REFERENCE], slope, movable,
        Cameras(X_STEPS, Y_STEPS, REFERENCE), SCALES, drift,
    )  # fmt: skip
    each = slope.astype(float)
    told, sides = np.zeros(SHAPE), {}
    for v, u in np.ndindex(SHAPE):
        part = each[window_of(v, u, 3)]
        if movable[v, u] and part.max() - part.min() > 3 * STEP_PX:
            far, near = sides[v, u] = sides_of(each, v, u)
            of_far, of_near = (differences(images, v, u, m, drift) for m in (far, near))
            told[v, u] = preference(of_near, of_far)
    expected, moves, close = each.copy(), {"far": 0, "near": 0}, 0
    for (v, u), (far, near) in sides.items():
        part = window_of(v, u, 1)
        grey = images[REFERENCE].astype(float)
        w = 1 / (1 + ((grey[part] - grey[v, u]) * 0.5 / SCALES.likeness) ** 2) ** 2
        total, limit = float((w * told[part]).sum()), 0.5 * SCALES.doubt * float(w.sum())
        is_near = each[v, u] - far > near - each[v, u]
        close += abs(abs(total) - limit) < 0.02
        if is_near and total > limit:
            expected[v, u], moves["far"] = far, moves["far"] + 1
        elif not is_near and total < -limit:
            expected[v, u], moves["near"] = near, moves["near"] + 1
    assert min(moves.values()) > 0
    assert close == 0
    assert np.abs(found - expected).max() < 1e-3


def test_a_jump_of_three_labels_is_none_yet():
    images = np.random.default_rng(61).uniform(80, 130, (6, *SHAPE)).astype(np.float32)
    slope = np.where(np.arange(SHAPE[1]) < 9, 0.0, 2.99 * STEP_PX) + np.zeros(SHAPE)
    slope = slope.astype(np.float32)
    found = choose_sides(
        pad(images, X_STEPS, Y_STEPS), images[REFERENCE], slope, np.ones(SHAPE, np.bool_),
        Cameras(X_STEPS, Y_STEPS, REFERENCE), SCALES,
    )  # fmt: skip
    assert np.array_equal(found, slope)
