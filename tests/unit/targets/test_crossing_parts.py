"""The pieces of the model of two crossing edges, each against its formula in double precision."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from rig.arrays import Float
from rig.targets import crossing
from rig.targets.crossing import PARAMETERS, Markers, crossing_model, crossing_shape

X = np.linspace(-4.0, 4.0, 33)[None]
BLUR = np.array([[0.9]])
Part = Callable[..., crossing._Light]


def rise(across_px: Float, blur_px: float = 0.9) -> crossing._Rise:
    return crossing._rise(across_px, np.array([[blur_px]]))


@pytest.mark.parametrize("blur_px", [0.4, 0.9, 2.5])
def test_a_blurred_step_is_the_normal_integral(blur_px: float) -> None:
    found = rise(X, blur_px)
    assert found.value == pytest.approx(norm.cdf(X / blur_px), abs=1.6e-7)
    assert found.slope == pytest.approx(norm.pdf(X / blur_px) / blur_px, rel=1e-6, abs=1e-9)
    assert found.across_px is X


def test_far_from_the_edge_nothing_is_denormal() -> None:
    found = rise(np.array([[-90.0, 90.0]]))
    assert found.value == pytest.approx(np.array([[0.0, 1.0]]), abs=1e-15)
    assert found.slope == pytest.approx(
        np.full((1, 2), np.exp(-36.0) / np.sqrt(2 * np.pi) / 0.9), rel=1e-5
    )


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
    x, y = np.meshgrid(np.linspace(-3, 3, 13), np.linspace(-2.5, 2.5, 11))
    x, y = x.reshape(1, -1), y.reshape(1, -1)
    found = part(rise(x), rise(y), np.array([[rho]]), BLUR)
    assert found.value == pytest.approx(formula(x, y, rho, 0.9), abs=4e-7)
    step = 1e-4
    by_rho = (formula(x, y, rho + step, 0.9) - formula(x, y, rho - step, 0.9)) / (2 * step)
    assert found.by_rho == pytest.approx(by_rho, abs=1e-6)


@pytest.mark.parametrize(("part", "formula"), PAIRS)
@pytest.mark.parametrize("rho", [0.0, 0.02])
def test_light_changes_with_places_and_blur(
    part: Part, formula: Callable[[Float, Float, float, float], Float], rho: float
) -> None:
    x, y = np.meshgrid(np.linspace(-3, 3, 13), np.linspace(-2.5, 2.5, 11))
    x, y = x.reshape(1, -1), y.reshape(1, -1)
    found = part(rise(x), rise(y), np.array([[rho]]), BLUR)
    step = 1e-4
    by_one = (formula(x + step, y, rho, 0.9) - formula(x - step, y, rho, 0.9)) / (2 * step)
    by_two = (formula(x, y + step, rho, 0.9) - formula(x, y - step, rho, 0.9)) / (2 * step)
    by_blur = (formula(x, y, rho, 0.9 + step) - formula(x, y, rho, 0.9 - step)) / (2 * step)
    # To the first power of the correlation.
    close = 1e-6 + rho**2
    assert found.by_one == pytest.approx(by_one, abs=close)
    assert found.by_two == pytest.approx(by_two, abs=close)
    assert found.by_blur == pytest.approx(by_blur, abs=3 * close)


@pytest.mark.parametrize("side", [1, -1])
def test_a_quadrant_taken_away_turns_derivatives_by_place_with_its_side(side: int) -> None:
    light = crossing._Light(*(np.array([[float(n)]]) for n in (10, 20, 30, 40, 50)))
    light.subtract(crossing._Light(*(np.array([[float(n)]]) for n in (1, 2, 3, 4, 5))), side)
    found = [float(part[0, 0]) for part in (light.value, light.by_one, light.by_two)]
    assert found == [9.0, 20.0 - side * 2, 30.0 - side * 3]
    assert (float(light.by_blur[0, 0]), float(light.by_rho[0, 0])) == (36.0, 45.0)


def test_what_counts_ends_within_the_border_of_a_marker() -> None:
    one = np.array([[-5.0, 0.7, 1.0, 1.3, 5.0, 5.0, 5.0]], np.float32)
    two = np.array([[5.0, 5.0, 5.0, 5.0, 5.0, 2.2, 1.9]], np.float32)
    border = np.array([[2.5, 3.5]], np.float32)
    # Room: half a pixel and the border, less two blurs of 0.9: 1.2 and 2.2.
    found = crossing._outside(one, two, border, np.float32(0.9).reshape(1, 1))
    assert found == pytest.approx(np.array([[1.0, 0.5, 0.2, 0.0, 0.0, 0.0, 0.3]]), abs=1e-6)


def test_an_edge_knows_along_across_and_its_normal() -> None:
    value = np.array([[1.0, 2.0, np.pi / 2, 0.0, 0.9, 0.0, 1.0]])
    offset = np.array([[1.0, 2.0], [4.0, 7.0]], np.float32)
    upright, level = crossing._edge(offset, value, 2), crossing._edge(offset, value, 3)
    assert upright.normal == pytest.approx(np.array([[-1.0, 0.0]]), abs=1e-6)
    assert upright.across_px == pytest.approx(np.array([[0.0, -3.0]]), abs=1e-6)
    assert upright.along_px == pytest.approx(np.array([[0.0, 5.0]]), abs=1e-6)
    assert level.across_px == pytest.approx(np.array([[0.0, 5.0]]), abs=1e-6)
    assert level.along_px == pytest.approx(np.array([[0.0, 3.0]]), abs=1e-6)
    # Of the cosine between the normals, by the angle of the first: -sin(90 deg).
    assert crossing._by_angle(upright, level) == pytest.approx(np.array([[-1.0]]), abs=1e-6)
    assert crossing._by_angle(level, upright) == pytest.approx(np.array([[1.0]]), abs=1e-6)


OFFSET = np.stack(np.meshgrid(np.arange(-6.0, 7.0), np.arange(-6.0, 7.0)), axis=-1).reshape(-1, 2)


def grey(value: Float, markers: Markers | None = None) -> Float:
    shape = crossing_shape(OFFSET.astype(np.float32), value, markers)
    return crossing_model(shape, value)[0].astype(np.float64)


@pytest.mark.parametrize("half", [60.0, -60.0])
def test_derivatives_of_a_square_crossing_are_exact(half: float) -> None:
    at = np.array([[0.2, -0.3, 0.3, 0.3 + np.pi / 2, 1.1, 110.0, half]])
    _, jacobian = crossing_model(crossing_shape(OFFSET.astype(np.float32), at, None), at)
    for column in range(PARAMETERS):
        step = np.zeros_like(at)
        step[0, column] = 0.01
        change = (grey(at + step) - grey(at - step)) / 0.02
        # Third derivatives and single precision leave a few thousandths.
        assert jacobian[0, column] == pytest.approx(change[0], abs=4e-3 * np.abs(change).max())


@pytest.mark.parametrize("half", [60.0, -60.0])
def test_derivatives_beside_even_markers_are_exact(half: float) -> None:
    at = np.array([[0.2, -0.3, 0.3, 0.3 + np.pi / 2, 1.1, 110.0, half]])
    ones = np.ones((1, 2), np.float32)
    even = Markers(2.0 * ones, 1.5 * ones, 0.2 * ones, 0.0 * ones)
    _, jacobian = crossing_model(crossing_shape(OFFSET.astype(np.float32), at, even), at)
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
        np.array([[2.0, 3.0]], np.float32),
        np.array([[1.0, 1.0]], np.float32),
        np.array([[0.3, 0.4]], np.float32),
        np.array([[0.1, 0.2]], np.float32),
    )
    fine = np.stack(np.meshgrid(np.arange(-8, 8, 0.25), np.arange(-8, 8, 0.25)), axis=-1)
    x, y = fine.reshape(-1, 2).T + 0.125
    shape = crossing_shape(np.stack([x, y], axis=-1).astype(np.float32), at, markers)
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
    assert shape.value[0, clear] == pytest.approx(wanted[clear], abs=1e-3)
    assert (wanted[clear] == -sign).sum() > 1500


def test_markers_of_some_crossings_keep_all_four_measures() -> None:
    numbers = np.arange(24, dtype=np.float32).reshape(4, 3, 2)
    part = Markers(*numbers).part(np.array([False, True, True]))
    assert [m.tolist() for m in (part.margin_px, part.border_px, part.uneven_px, part.fan)] == [
        numbers[k, 1:].tolist() for k in range(4)
    ]
