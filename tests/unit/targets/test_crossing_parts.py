"""The pieces of the model of two crossing edges, each against its formula in double precision."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from rig.arrays import Float
from rig.targets import crossing
from rig.targets.crossing import PARAMETERS, Markers, crossing_model

X = np.linspace(-4.0, 4.0, 33)
BLUR_PX = 0.9
Part = Callable[..., crossing.Light]


def rise(across_px: float, blur_px: float = BLUR_PX) -> crossing.Rise:
    return crossing._rise(across_px, blur_px)


@pytest.mark.parametrize("blur_px", [0.4, 0.9, 2.5])
def test_a_blurred_step_is_the_normal_integral(blur_px: float) -> None:
    found = np.array([rise(x, blur_px) for x in X])
    assert found[:, 0] == pytest.approx(norm.cdf(X / blur_px), abs=2.2e-6)
    assert found[:, 1] == pytest.approx(norm.pdf(X / blur_px) / blur_px, rel=2e-5, abs=3e-5)


@pytest.mark.parametrize(("widths", "slope"), [(4.59, True), (4.61, False)])
def test_an_edge_is_felt_to_so_many_widths(widths: float, slope: bool) -> None:
    for side in (1, -1):
        found = rise(side * widths * BLUR_PX)
        assert found[0] == pytest.approx(float(side > 0), abs=3e-6)
        assert (found[1] > 0) is slope


def one_quadrant(x: Float, y: Float, rho: float, blur: float) -> Float:
    """To the second power of the correlation."""
    a, b = x / blur, y / blur
    bells = norm.pdf(a) * norm.pdf(b)
    return norm.cdf(a) * norm.cdf(b) + bells * (rho + rho**2 / 2 * a * b)


def two_quadrants(x: Float, y: Float, rho: float, blur: float) -> Float:
    return one_quadrant(x, y, rho, blur) + one_quadrant(-x, -y, rho, blur)


PAIRS: list[tuple[Part, Callable[[Float, Float, float, float], Float]]] = [
    (crossing._quadrant, one_quadrant),
    (crossing._opposite_quadrants, two_quadrants),
]


@pytest.mark.parametrize(("part", "formula"), PAIRS)
@pytest.mark.parametrize("rho", [0.0, 0.2, -0.35])
def test_light_and_its_change_with_the_slant(
    part: Part, formula: Callable[[Float, Float, float, float], Float], rho: float
) -> None:
    x, y = (p.ravel() for p in np.meshgrid(np.linspace(-3, 3, 13), np.linspace(-2.5, 2.5, 11)))
    found = lights(part, x, y, rho)
    # The table of steps is good to 2e-6.
    assert found[:, 0] == pytest.approx(formula(x, y, rho, BLUR_PX), abs=4e-6)
    step = 1e-4
    by_rho = formula(x, y, rho + step, BLUR_PX) - formula(x, y, rho - step, BLUR_PX)
    assert found[:, 4] == pytest.approx(by_rho / (2 * step), abs=5e-6)


def lights(part: Part, x: Float, y: Float, rho: float) -> Float:
    return np.array([part(a, b, rise(a), rise(b), rho, BLUR_PX) for a, b in zip(x, y, strict=True)])


@pytest.mark.parametrize(("part", "formula"), PAIRS)
@pytest.mark.parametrize("rho", [0.0, 0.02])
def test_light_changes_with_places_and_blur(
    part: Part, formula: Callable[[Float, Float, float, float], Float], rho: float
) -> None:
    x, y = (p.ravel() for p in np.meshgrid(np.linspace(-3, 3, 13), np.linspace(-2.5, 2.5, 11)))
    found = lights(part, x, y, rho)
    step = 1e-4
    by_one = formula(x + step, y, rho, BLUR_PX) - formula(x - step, y, rho, BLUR_PX)
    by_two = formula(x, y + step, rho, BLUR_PX) - formula(x, y - step, rho, BLUR_PX)
    by_blur = formula(x, y, rho, BLUR_PX + step) - formula(x, y, rho, BLUR_PX - step)
    # To the first power of the correlation.
    close = 1e-5 + rho**2
    assert found[:, 1] == pytest.approx(by_one / (2 * step), abs=close)
    assert found[:, 2] == pytest.approx(by_two / (2 * step), abs=close)
    assert found[:, 3] == pytest.approx(by_blur / (2 * step), abs=3 * close)


def test_what_counts_ends_within_the_border_of_a_marker() -> None:
    # Room: half a pixel and the border, less two blurs of 0.9: 1.2 and 2.2.
    places = ((-5, 5), (0.7, 5), (1.0, 5), (1.3, 5), (5, 5), (5, 2.2), (5, 1.9))
    found = [crossing._outside(float(a), float(b), 2.5, 3.5, BLUR_PX) for a, b in places]
    assert found == pytest.approx([1.0, 0.5, 0.2, 0.0, 0.0, 0.0, 0.3])


@pytest.mark.parametrize(("half", "sign"), [(2.0, 1.0), (0.0, 1.0), (-2.0, -1.0)])
def test_edges_are_normals_blur_and_sign(half: float, sign: float) -> None:
    value = np.array([1.0, 2.0, np.pi / 2, 0.0, 0.9, 0.0, half])
    assert crossing.edges_of(value) == pytest.approx((-1.0, 0.0, 0.0, 1.0, 0.9, sign))


OFFSET = np.stack(np.meshgrid(np.arange(-6.0, 7.0), np.arange(-6.0, 7.0)), axis=-1).reshape(-1, 2)


def grey(value: Float, markers: Markers | None = None) -> Float:
    return crossing_model(OFFSET, value, markers)[0]


@pytest.mark.parametrize("half", [60.0, -60.0])
def test_derivatives_of_a_square_crossing_are_exact(half: float) -> None:
    at = np.array([[0.2, -0.3, 0.3, 0.3 + np.pi / 2, 1.1, 110.0, half]])
    _, jacobian, _ = crossing_model(OFFSET, at, None)
    for column in range(PARAMETERS):
        step = np.zeros_like(at)
        step[0, column] = 0.01
        change = (grey(at + step) - grey(at - step)) / 0.02
        # Third derivatives and single precision leave a few thousandths.
        assert jacobian[0, column] == pytest.approx(change[0], abs=4e-3 * np.abs(change).max())


@pytest.mark.parametrize("half", [60.0, -60.0])
def test_derivatives_beside_even_markers_are_exact(half: float) -> None:
    at = np.array([[0.2, -0.3, 0.3, 0.3 + np.pi / 2, 1.1, 110.0, half]])
    ones = np.ones((1, 2))
    even = Markers(2.0 * ones, 1.5 * ones, 0.2 * ones, 0.0 * ones)
    _, jacobian, _ = crossing_model(OFFSET, at, even)
    for column in range(PARAMETERS):
        step = np.zeros_like(at)
        step[0, column] = 0.01
        change = (grey(at + step, even) - grey(at - step, even)) / 0.02
        assert jacobian[0, column] == pytest.approx(change[0], abs=4e-3 * np.abs(change).max())


@pytest.mark.parametrize("half", [60.0, -60.0])
def test_markers_begin_where_their_margins_say(half: float) -> None:
    """Sharp edges along the axes: a marker's corner lies at margin +- unevenness + fan along."""
    at = np.array([[0.0, 0.0, 0.0, np.pi / 2, 0.05, 100.0, half]])
    markers = Markers(
        np.array([[2.0, 3.0]]),
        np.array([[1.0, 1.0]]),
        np.array([[0.3, 0.4]]),
        np.array([[0.1, 0.2]]),
    )
    fine = np.stack(np.meshgrid(np.arange(-8, 8, 0.25), np.arange(-8, 8, 0.25)), axis=-1)
    x, y = fine.reshape(-1, 2).T + 0.125
    grey, _, _ = crossing_model(np.stack([x, y], axis=-1), at, markers)
    level = (grey[0] - 100.0) / half
    # Across the first edge is y, along it x; across the second -x, along it y.
    sign = 1 if half > 0 else -1
    bright = (y * -x * sign) > 0
    wanted = np.where(bright, sign, -sign)
    for side in (1, -1):
        a = side * y - (2.0 + side * 0.3) - 0.1 * x
        b = side * sign * -x - (3.0 + side * sign * 0.4) - 0.2 * y
        wanted = np.where((a > 0) & (b > 0), -sign, wanted)
        near = np.minimum(np.abs(a), np.abs(b)) < 0.2
        wanted = np.where(near, 0, wanted)
    clear = (np.minimum(np.abs(x), np.abs(y)) > 0.2) & (wanted != 0)
    assert level[clear] == pytest.approx(wanted[clear], abs=1e-3)
    assert (wanted[clear] == -sign).sum() > 1500


def test_markers_have_eight_measures() -> None:
    numbers = np.arange(24.0).reshape(4, 3, 2)
    assert Markers(*numbers).measures().tolist() == np.hstack(list(numbers)).tolist()
