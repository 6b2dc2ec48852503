"""The least squares of places beside one that keeps every grey value and slope as an unknown."""

from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.placement.equations import (
    Lines,
    eliminate,
    normal_equations_of_halves,
    summed,
)
from rig.epipolar.placement.fit import find_placement
from rig.epipolar.placement.placement import Placement, on_their_lines
from rig.epipolar.placement.solve import Fit, expect_alike, fit_places, slope_variance
from rig.epipolar.search.window import Cameras

Array = NDArray[np.float64]
RNG = np.random.default_rng(101)
X_STEPS, Y_STEPS = np.array([0.0, 1.0, -1.2, 0.1, 0.0]), np.array([0.0, 0.1, 0.0, 1.1, -0.9])
COUNT, HALF = 240, 130
TRUE = np.array([
    [0, 0, 0, 0], [0.06, -0.05, 0, 0.01], [-0.04, 0, 0.02, 0], [0, 0.08, 0, 0], [0.03, 0, 0, 0],
])  # fmt: skip


def lines_of(noise: float, places: Array = TRUE) -> Lines:
    across, down = RNG.normal(0, 12, (2, COUNT))
    slope = RNG.uniform(-4, 5, COUNT)
    design = np.hstack([-np.stack([across, down], 1), slope[:, None] * np.stack([across, down], 1)])
    own_slope, own_grey = RNG.normal(0, 0.1, COUNT), RNG.normal(0, 3, COUNT)
    tilt = -(across[:, None] * X_STEPS + down[:, None] * Y_STEPS)
    difference = design @ places.T + own_slope[:, None] * tilt + own_grey[:, None]
    difference += noise * RNG.normal(size=(COUNT, 5))
    seen = RNG.random((COUNT, 5)) < 0.95
    seen[:, 0] = True
    return Lines(difference, seen, across, down, slope, HALF, np.arange(0, COUNT, 10))


def test_halves_design_and_tilts_of_lines():
    lines = lines_of(1.0)
    assert lines.halves == (slice(HALF), slice(HALF, None))
    n = 17
    a, d, m = lines.across[n], lines.down[n], lines.slope_px[n]
    assert lines.design[n] == pytest.approx([-a, -d, m * a, m * d])
    assert lines.tilts(X_STEPS, Y_STEPS)[n] == pytest.approx(-(a * X_STEPS + d * Y_STEPS))


def full_normal(lines: Lines, weight: Array, part: slice) -> tuple[Array, Array]:
    """Normal equations of the places with the unknowns of each pixel eliminated by a Schur step."""
    normal, right = np.zeros((20, 20)), np.zeros(20)
    tilt = lines.tilts(X_STEPS, Y_STEPS)
    for n in range(COUNT)[part]:
        own = np.column_stack([np.ones(5), tilt[n]])
        wide = np.zeros((5, 20))
        for view in range(5):
            wide[view, 4 * view : 4 * view + 4] = lines.design[n]
        w = np.diag(weight[n])
        inner = np.linalg.inv(own.T @ w @ own)
        left = w - w @ own @ inner @ own.T @ w
        normal += wide.T @ left @ wide
        right += wide.T @ left @ lines.difference[n]
    return normal, right


def test_grey_values_and_slopes_are_eliminated_exactly():
    lines = lines_of(1.0)
    weight = lines.seen * RNG.uniform(0.3, 1.0, (COUNT, 5))
    eliminated = eliminate(weight, lines.tilts(X_STEPS, Y_STEPS))
    for found, part in zip(
        normal_equations_of_halves(lines, eliminated), lines.halves, strict=True
    ):
        normal, right = full_normal(lines, weight, part)
        assert found[0] == pytest.approx(normal, rel=1e-6, abs=1e-6 * np.abs(normal).max())
        assert found[1] == pytest.approx(right, rel=1e-6, abs=1e-6 * np.abs(right).max())


def test_sums_over_pixels_are_those_of_one_product():
    one, other = RNG.normal(size=(1900, 20)), RNG.normal(size=(1900, 9))
    assert np.allclose(summed(one, other), np.einsum("na,nb->ab", one, other))
    wide = RNG.normal(size=(3, 500))
    assert np.allclose(summed(wide, wide), np.einsum("na,nb->ab", wide, wide))


def held_directions() -> Array:
    """Shifts in proportion to the positions, and positions all too large."""
    places = np.stack([X_STEPS, Y_STEPS], axis=1)
    moves = np.zeros((2, 5, 4))
    moves[0, :, :2] = moves[1, :, 2:] = places
    return moves


def without_held(places: Array) -> Array:
    """What of places (V, 4) can be told."""
    step = 0.3 / 5.0
    scaled = places / [0.3, 0.3, step, step]
    for move in held_directions() / [0.3, 0.3, step, step]:
        scaled = scaled - move * (scaled * move).sum() / (move**2).sum()
    return scaled * [0.3, 0.3, step, step]


def test_places_are_told_but_for_what_no_match_can_know():
    found = fit_places(lines_of(1e-3), X_STEPS, Y_STEPS, 0, 1.0)
    for move in held_directions():
        scaled = found.found / [0.3, 0.3, 0.06, 0.06] ** np.array(2)
        assert abs(float((scaled * move).sum())) < 0.05 * np.abs(scaled).max()
    assert np.abs(found.found[0]).max() < 1e-6
    # The rest explains the differences: what is left of the truth is the held part.
    rest = found.found - TRUE
    told = sum(
        float(np.linalg.lstsq(held_directions().reshape(2, -1).T, rest.ravel())[0][k])
        * held_directions()[k]
        for k in (0, 1)
    )
    assert rest == pytest.approx(np.asarray(told), abs=2e-3)


def test_the_covariance_of_places_is_that_of_repetitions():
    found, covariance = [], []
    for _ in range(24):
        fit = fit_places(lines_of(2.0, 0 * TRUE), X_STEPS, Y_STEPS, 0, 9.0)
        found.append(fit.found[1:].ravel())
        covariance.append(np.diag(fit.covariance).reshape(5, 4)[1:].ravel())
    ratio = np.square(found).mean(axis=0) / np.mean(covariance, axis=0)
    assert float(np.mean(ratio)) == pytest.approx(1.0, abs=0.3)
    # What moving the second view to its place gains, over many draws of the noise; without a
    # wrong place there is nothing to gain.
    gained, nothing = (
        [fit_places(lines_of(2.0, places), X_STEPS, Y_STEPS, 0, 9.0).gain[1] for _ in range(16)]
        for places in (TRUE, 0 * TRUE)
    )
    assert np.mean(gained) > 1.0
    assert np.mean(nothing) < 0.5
    assert abs(fit_places(lines_of(2.0, 0 * TRUE), X_STEPS, Y_STEPS, 0, 9.0).gain[2]) < 4


def test_normal_equations_of_a_fit_are_those_of_its_noise():
    lines = lines_of(2.0, 0 * TRUE)
    fit = fit_places(lines, X_STEPS, Y_STEPS, 0, 5.0)
    normal, _ = full_normal(lines, lines.seen.astype(float), slice(None))
    # Cauchy weights at three sigmas take about a tenth of it.
    share = np.trace(fit.information) / np.trace(normal / 2.0**2)
    assert 0.3 < share < 1.4


def test_a_row_of_views_does_not_tell_its_turn():
    x_steps, y_steps = np.array([-2.0, -1.0, 0.0, 1.0, 2.0]), np.array([0.0, 0.05, 0.0, 0.0, 0.0])
    lines = lines_of(0.5, 0 * TRUE)
    turned = np.zeros((5, 4))
    turned[:, 1] = 0.1 * x_steps
    lines.difference[:] += lines.design @ turned.T
    found = fit_places(lines, x_steps, y_steps, 2, 1.0)
    assert np.abs(found.found[:, 1] @ x_steps) < 0.02
    wide = fit_places(lines, x_steps, np.array([0.0, 0.9, 0.0, 0.8, -0.9]), 2, 1.0)
    assert np.abs(wide.found[:, 1] @ x_steps) > 0.1


def plain_expectation(
    fit: Fit, kinds: list[list[int]], reference: int, largest_px: float
) -> tuple[Array, Array]:
    floor = np.array([1e-5, 1e-5, 1e-5 / largest_px, 1e-5 / largest_px])
    found, covariance = fit.found, fit.covariance
    for _ in range(4):
        expected = np.tile(floor**2, (5, 1))
        for kind in kinds:
            square = np.diag(covariance).reshape(5, 4)[kind] + found[kind] ** 2
            shift, step = square[:, :2].mean(), square[:, 2:].mean()
            expected[kind] = np.maximum([shift, shift, step, step], floor**2)
        expected[reference] = (1e-3 * floor) ** 2
        inverse = np.linalg.inv(fit.information + np.diag(1 / expected.ravel()))
        covariance = np.asarray(inverse, np.float64)
        found = (covariance @ fit.right).reshape(5, 4)
    return np.asarray(found, np.float64), covariance


@pytest.mark.parametrize(
    ("misplaced", "kinds"),
    [
        ([], [[1, 2, 3, 4]]),
        ([3], [[3], [1, 2, 4]]),
        ([1, 3], [[1, 3], [2, 4]]),
        ([1, 2, 3], [[1, 2, 3, 4]]),
    ],
)
def test_each_kind_of_views_is_expected_to_be_off_as_it_is(
    misplaced: list[int], kinds: list[list[int]]
):
    fit = fit_places(lines_of(2.0), X_STEPS, Y_STEPS, 0, 5.0)
    is_misplaced = np.isin(np.arange(5), misplaced)
    found, covariance = expect_alike(fit, is_misplaced, 0, 5.0)
    expected = plain_expectation(fit, kinds, 0, 5.0)
    assert found == pytest.approx(expected[0], rel=1e-6, abs=1e-12)
    assert covariance == pytest.approx(expected[1], rel=1e-6, abs=1e-14)


def test_what_errors_of_places_do_to_slopes():
    lines = lines_of(1.0)
    tilt = lines.tilts(X_STEPS, Y_STEPS)
    root = RNG.normal(size=(20, 20))
    moment = root @ root.T
    found = slope_variance(lines, tilt, moment)
    # A pixel's slope answers to places e by -sum(tilt * (design @ e)) / sum(tilt^2); pixels count
    # by their information, and the part in proportion to the slope is apart.
    expected = np.zeros((2, 2))
    for n in range(COUNT):
        answer = np.zeros((2, 20))
        for view in range(5):
            gradient = np.array([lines.across[n], lines.down[n]])
            answer[0, 4 * view : 4 * view + 2] = tilt[n, view] * gradient
            answer[1, 4 * view + 2 : 4 * view + 4] = tilt[n, view] * gradient
        expected += answer @ moment @ answer.T / float((tilt[n] ** 2).sum())
    expected /= float((tilt**2).sum())
    assert found == pytest.approx([expected[0, 0], -2 * expected[0, 1], expected[1, 1]])


def test_sigma_of_slopes_is_a_polynomial():
    none = np.zeros((2, 2))
    placement = Placement(
        none, none, np.zeros(2), np.zeros(2), np.zeros(2, np.bool_), np.array([0.04, -0.01, 0.09])
    )
    slope = np.array([[0.0, 2.0, -1.0]], np.float32)
    assert placement.slope_sigma_px(slope)[0] == pytest.approx([0.2, 0.38**0.5, 0.14**0.5])
    below = Placement(
        none, none, np.zeros(2), np.zeros(2), np.zeros(2, np.bool_), np.array([0.01, -0.1, 0.0])
    )
    assert below.slope_sigma_px(slope)[0, 1] == 0.0


def test_misplaced_views_are_named_with_their_places():
    placement = Placement(
        np.array([[0.0, 0.0], [0.25, -0.5]]), np.array([[0.0, 0.0], [0.02, -0.03]]),
        np.array([0.0, 1.25]), np.array([0.0, 0.11]), np.array([False, True]), np.zeros(3),
    )  # fmt: skip
    (said,) = placement.warnings(np.array([0.0, 1.0]), np.array([0.0, 2.0]))
    for part in (
        "view 1 at (1, 2)", "1.25 px", "0.11", "(1.0200, 1.9700)", "(+0.25, -0.50)",
    ):  # fmt: skip
        assert part in said


def test_a_moved_picture_is_a_windowed_sinc():
    picture = RNG.uniform(0, 200, (24, 26)).astype(np.float32)
    shift = np.array([[1.3, -0.4], [0.0, 0.0]])
    moved = on_their_lines(np.stack([picture, picture]), shift)
    assert np.array_equal(moved[1], picture)

    def taps(shift_px: float) -> Array:
        away = np.arange(-7, 8) - shift_px
        window = np.where(np.abs(away) < 4, np.cos(np.pi * away / 8) ** 2, 0)
        weights = np.sinc(away) * window
        return cast("Array", weights / weights.sum())

    wide = np.pad(picture.astype(float), 7, mode="edge")
    across, down = taps(1.3), taps(-0.4)
    for v, u in ((0, 0), (12, 13), (23, 25), (2, 20)):
        assert moved[0, v, u] == pytest.approx(
            float(down @ wide[v : v + 15, u : u + 15] @ across), abs=0.01
        )


def picture_of(shape: tuple[int, int], x: float, y: float) -> Array:
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]].astype(float)
    u, v = columns + 1.0 * x, rows + 1.0 * y
    return 120 + 40 * np.sin(0.55 * u + 0.2 * v) + 30 * np.cos(0.5 * v - 0.3 * u)


@pytest.mark.parametrize(
    ("shape", "is_enough"), [((104, 128), True), ((103, 128), True), ((87, 128), False)]
)
def test_a_hundred_and_fifty_cells_are_enough(shape: tuple[int, int], is_enough: bool):
    cameras = Cameras(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0)
    images = np.stack([picture_of(shape, *xy) for xy in ((0, 0), (1, 0), (0, 1))])
    images = (images + RNG.normal(0, 0.5, images.shape)).astype(np.float32)
    slope = np.ones(shape, np.float32)
    found = find_placement(images, slope, np.zeros(images.shape, np.bool_), cameras, 0.5)
    assert (found is not None) == is_enough
    hidden = np.zeros(images.shape, np.bool_)
    hidden[1, :, 20:] = True
    assert find_placement(images, slope, hidden, cameras, 0.5) is None
