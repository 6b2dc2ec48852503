"""One step of every pixel's line beside its normal equations, written out view by view."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from rig.epipolar.line import HALF_HIDDEN, SEEN, UNSEEN, fit_lines
from rig.epipolar.search.halves import assign_halves

X_STEPS = np.array([-1.0, 0.0, 1.5, 0.0, 0.0, 2.0, -2.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -1.0, 1.2, 0.5, 0.3])
REFERENCE, SHAPE = 1, (13, 17)
SCALE, VARIANCE, LOCKING, REACH_PX = 25.0, 3.0, (4.0, -7.0, 11.0), 0.4
RNG = np.random.default_rng(4)


def smooth_images(misfit: float) -> NDArray[np.float32]:
    rows, columns = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)
    grey = [
        120 + 30 * np.sin(0.7 * (columns + 0.6 * x)) + 25 * np.cos(0.6 * (rows + 0.6 * y) + columns)
        for x, y in zip(X_STEPS, Y_STEPS, strict=True)
    ]
    return (np.stack(grey) + RNG.normal(0, misfit, (7, *SHAPE))).astype(np.float32)


def sampled(image: NDArray[np.float32], x: float, y: float) -> float:
    return float(map_coordinates(image.astype(float), [[y], [x]], order=3, mode="mirror")[0])


def locked(place: float) -> float:
    s = place - np.floor(place) - 0.5
    return s * (LOCKING[0] + s**2 * (LOCKING[1] + s**2 * LOCKING[2]))


def hidden_halves(poor: NDArray[np.float64], members: NDArray[np.float64]) -> list[int]:
    """Halves that fit worse than their scale, and 2.5 times worse than the other of their axis."""
    hidden = []
    for h in range(4):
        other = h ^ 1
        worse = poor[h] * members[other] > 2.5 * poor[other] * members[h]
        if worse and poor[h] > members[h]:
            hidden.append(h)
    return hidden


def plain_step(
    images: NDArray[np.float32],
    start: float,
    v: int,
    u: int,
    covered: NDArray[np.bool_],
    drift: NDArray[np.float32] | None,
) -> dict[str, float]:
    half = assign_halves(X_STEPS, Y_STEPS)
    centre = float(images[REFERENCE, v, u])
    views = []
    poor, members = np.zeros(4), np.zeros(4)
    for i in np.flatnonzero(half >= 0):
        x, y = u - start * X_STEPS[i], v - start * Y_STEPS[i]
        if not (0 <= x <= SHAPE[1] - 1 and 0 <= y <= SHAPE[0] - 1):
            continue
        e = 1e-3
        ahead = sampled(images[i], x - e * X_STEPS[i], y - e * Y_STEPS[i])
        behind = sampled(images[i], x + e * X_STEPS[i], y + e * Y_STEPS[i])
        lit = centre
        if drift is not None:
            lit += X_STEPS[i] * drift[0, v, u] + Y_STEPS[i] * drift[1, v, u]
        g, j = sampled(images[i], x, y) - lit, (ahead - behind) / (2 * e)
        seen = 0.01 if covered[i, v, u] else 1.0
        lock = -X_STEPS[i] * locked(x) - Y_STEPS[i] * locked(y)
        noise = VARIANCE * (X_STEPS[i] ** 2 + Y_STEPS[i] ** 2)
        poor[half[i]] += seen * min(abs(g) / SCALE, 3.0)
        members[half[i]] += seen
        views.append((half[i], g, j, seen, lock, noise))
    gone = hidden_halves(poor, members)
    kept = [h for h in range(4) if h not in gone]
    w0 = [(seen / (1 + (g / SCALE) ** 2), g, j, lock, noise)
          for h, g, j, seen, lock, noise in views if h in kept]  # fmt: skip
    w, g, j, lock, noise = (
        np.array(column) for column in zip((1.0, 0.0, 0.0, 0.0, 0.0), *w0, strict=True)
    )
    total = w.sum()
    info = (w * j**2).sum() - (w * j).sum() ** 2 / total
    cross = (w * j * g).sum() - (w * j).sum() * (w * g).sum() / total
    cross -= (w * lock).sum() * (1 - 1 / total)
    scatter = (w * g**2).sum() - (w * g).sum() ** 2 / total - cross**2 / info
    sight = UNSEEN if members.sum() == 0 else HALF_HIDDEN if gone else SEEN
    return {
        "slope_px": start + float(np.clip(-cross / info, -REACH_PX, REACH_PX)),
        "information": info,
        "signal": info - (w * noise).sum() * (1 - 1 / total),
        "misfit": poor[kept].sum() / max(members[kept].sum(), 1e-6),
        "scatter": max(scatter, 0.0),
        "freedom": max(total - 2 * (w**2).sum() / total, 0.0),
        "sight": sight,
    }


@pytest.mark.parametrize("misfit", [2.0, 30.0], ids=["alike", "unlike"])
@pytest.mark.parametrize("is_drifting", [False, True], ids=["still", "drifting"])
def test_every_sum_of_a_step(misfit: float, is_drifting: bool):
    images = smooth_images(misfit)
    start = RNG.uniform(-0.9, 1.6, SHAPE).astype(np.float32)
    covered = RNG.random((7, *SHAPE)) < 0.2
    drift = RNG.uniform(-4, 4, (2, *SHAPE)).astype(np.float32) if is_drifting else None
    found = fit_lines(
        images, X_STEPS, Y_STEPS, REFERENCE, start, covered, SCALE, VARIANCE, LOCKING, REACH_PX,
        drift=drift,
    )  # fmt: skip
    seen = set()
    for v, u in [(0, 0), (6, 8), (12, 16), (3, 1), (9, 15), (6, 3), (2, 9), (10, 6), (7, 12)]:
        expected = plain_step(images, float(start[v, u]), v, u, covered, drift)
        for name, value in expected.items():
            told = float(getattr(found, name)[v, u])
            assert told == pytest.approx(value, rel=5e-3, abs=2e-2), (name, v, u)
        seen.add(expected["sight"])
    assert seen == {SEEN, HALF_HIDDEN}


def test_a_view_without_texture_tells_nothing_and_moves_nothing():
    images = np.zeros((7, *SHAPE), np.float32)
    start = np.full(SHAPE, 0.25, np.float32)
    found = fit_lines(
        images, X_STEPS, Y_STEPS, REFERENCE, start, np.zeros((7, *SHAPE), np.bool_), SCALE, 0.0,
        (0.0, 0.0, 0.0), REACH_PX,
    )  # fmt: skip
    assert np.array_equal(found.slope_px, start)
    assert not found.information.any()
    assert not found.signal.any()
    assert not found.scatter.any()
    # Six views that agree and the reference: 7 - 2 * 7 / 7.
    assert found.freedom[6, 8] == pytest.approx(5.0)


@pytest.mark.parametrize(("x_step", "y_step"), [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
def test_one_view_on_any_side_sees_what_it_shows(x_step: float, y_step: float):
    images = np.zeros((2, *SHAPE), np.float32)
    found = fit_lines(
        images, np.array([0.0, x_step]), np.array([0.0, y_step]), 0,
        np.full(SHAPE, 2.0, np.float32), np.zeros((2, *SHAPE), np.bool_), SCALE, 0.0,
        (0.0, 0.0, 0.0), REACH_PX,
    )  # fmt: skip
    rows, columns = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]]
    x, y = columns - 2 * x_step, rows - 2 * y_step
    is_shown = (x >= 0) & (x < SHAPE[1]) & (y >= 0) & (y < SHAPE[0])
    assert np.array_equal(found.sight == SEEN, is_shown)
    assert np.array_equal(found.sight == UNSEEN, ~is_shown)
