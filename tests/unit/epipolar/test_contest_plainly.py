"""Two slopes of every second pixel: the ratio of their likelihoods over a patch."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import correlate, map_coordinates, sobel

from rig.epipolar.contest import contested
from rig.epipolar.sampling import pad
from rig.epipolar.scales import Scales
from rig.epipolar.search.halves import assign_halves
from rig.epipolar.search.window import Cameras

X_STEPS = np.array([0.0, 1.0, -1.0, 0.0, 2.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, 1.0, 1.0])
SHAPE = (22, 27)
SCALES = Scales(noise=6.0, texture=20.0, start_error_px=0.3, misfit_px=0.4)
RNG = np.random.default_rng(72)


def badness(
    images: NDArray[np.float32], v: int, u: int, m: float, variance: float,
    drift: NDArray[np.float32] | None,
) -> float:  # fmt: skip
    half, sums = assign_halves(X_STEPS, Y_STEPS), {h: [] for h in range(4)}
    for i in np.flatnonzero(half >= 0):
        x, y = u - m * X_STEPS[i], v - m * Y_STEPS[i]
        if 0 <= x <= SHAPE[1] - 1 and 0 <= y <= SHAPE[0] - 1:
            told = map_coordinates(images[i].astype(float), [[y], [x]], order=3, mode="mirror")[0]
            if drift is not None:
                told -= X_STEPS[i] * drift[0, v, u] + Y_STEPS[i] * drift[1, v, u]
            d = told - float(images[0, v, u])
            sums[half[i]].append(min(d * d / variance, 9.0))
    axes = [[sum(sums[h]) for h in pair if sums[h]] for pair in ((0, 1), (2, 3))]
    return sum(min(axis) for axis in axes if axis)


@pytest.mark.parametrize("is_drifting", [False, True], ids=["still", "drifting"])
def test_a_rival_stands_where_it_fits_as_well_within_the_noise(is_drifting: bool):
    base = RNG.uniform(60, 160, SHAPE)
    images = (base + RNG.normal(0, 9, (5, *SHAPE))).astype(np.float32)
    slope = RNG.uniform(-0.3, 0.3, SHAPE).astype(np.float32)
    rival = RNG.uniform(-2.5, 2.5, SHAPE).astype(np.float32)
    rival[:, :14] = slope[:, :14] + 0.03
    rival[:6, :8] = np.nan
    drift = RNG.uniform(-15, 15, (2, *SHAPE)).astype(np.float32) if is_drifting else None
    cameras = Cameras(X_STEPS, Y_STEPS, 0)
    splines = pad(images, X_STEPS, Y_STEPS)
    found = contested(splines, slope, rival, cameras, SCALES, images[0], drift)
    grey = images[0].astype(float)
    across, down = (sobel(grey, axis, mode="mirror") / 8 for axis in (0, 1))
    power = np.asarray(across**2 + down**2, np.float64)
    variance = 2 * 6.0**2 + (0.3**2 + 0.4**2) * power
    rows, columns = range(0, SHAPE[0], 2), range(0, SHAPE[1], 2)
    gap = np.zeros((len(rows), len(columns)))
    for (i, v), (k, u) in ((a, b) for a in enumerate(rows) for b in enumerate(columns)):
        if np.isfinite(rival[v, u]):
            both = (badness(images, v, u, float(m), variance[v, u], drift)
                    for m in (rival[v, u], slope[v, u]))  # fmt: skip
            gap[i, k] = next(both) - next(both)
    ratio = 0.5 * 4 * correlate(gap, np.ones((9, 9)), mode="mirror")
    there = np.isfinite(rival[::2, ::2])
    doubtful = (ratio < 4.0) & there
    assert np.abs(ratio - 4.0)[there].min() > 0.01
    assert 0.05 < doubtful[there].mean() < 0.95
    assert found.shape == SHAPE
    assert np.array_equal(found[::2, ::2], doubtful)
    assert np.array_equal(found[1::2, 1::2], doubtful[:, : SHAPE[1] // 2])


def test_without_rivals_nothing_is_contested():
    images = np.zeros((5, *SHAPE), np.float32)
    nothing = np.full(SHAPE, np.nan, np.float32)
    cameras = Cameras(X_STEPS, Y_STEPS, 0)
    splines = pad(images, X_STEPS, Y_STEPS)
    assert not contested(splines, images[0], nothing, cameras, SCALES, images[0]).any()
