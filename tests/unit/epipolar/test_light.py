"""Light that differs over the picture: found as a gain and an offset, none where it is the same."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews, SlopeMap, estimate_slopes
from rig.epipolar.mending.light import LightField, fit_light
from tests.support.lightfield import (
    Surface,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

Array = NDArray[np.float64]

SHAPE = (90, 120)
PAIRS = 1500
ROWS, COLUMNS = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)


def across(x_px: Array, y_px: Array, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Coordinates from -1 to 1."""
    return 2.0 * x_px / (shape[1] - 1) - 1.0, 2.0 * y_px / (shape[0] - 1) - 1.0


def shading(x_px: Array, y_px: Array) -> Array:
    """A gain from 0.8 to 1.2."""
    s, t = across(x_px, y_px, SHAPE)
    return 1.0 + 0.12 * s - 0.08 * t * t + 0.05 * s * t


def haze(x_px: Array, y_px: Array) -> Array:
    """Up to 20 grey levels."""
    s, t = across(x_px, y_px, SHAPE)
    return 10.0 * t + 8.0 * s * s - 3.0


def pairs(seed: int, noise: float = 1.0) -> tuple[Array, Array, Array, Array]:
    """Columns, rows, grey values of the view without noise, and the noise of the target, (N,)."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, SHAPE[1] - 1, PAIRS), rng.uniform(0, SHAPE[0] - 1, PAIRS)
    grey = rng.uniform(40.0, 200.0, PAIRS)
    return x, y, grey, noise * rng.standard_normal(PAIRS)


def error_levels(found: LightField, gain: float, offset: float, wanted: Array) -> float:
    """Error of mended pictures of some grey values over the picture, rms."""
    errors = [
        gain * found.of(np.full(SHAPE, grey, np.float32)) + offset - (wanted[0] * grey + wanted[1])
        for grey in (60.0, 120.0, 180.0)
    ]
    return float(np.sqrt(np.mean(np.square(errors))))


def wanted(*, is_gain: bool) -> Array:
    gain = shading(COLUMNS, ROWS) if is_gain else np.ones(SHAPE)
    return np.stack([gain, np.zeros(SHAPE) if is_gain else haze(COLUMNS, ROWS)])


@pytest.mark.parametrize(("gain", "offset"), [(1.0, 0.0), (0.9, 6.0), (1.2, -4.0)])
@pytest.mark.parametrize("is_gain", [True, False], ids=["vignette", "haze"])
def test_fields_of_gain_and_of_offset_are_recovered(
    gain: float, offset: float, is_gain: bool
) -> None:
    x, y, grey, noise = pairs(1)
    target = shading(x, y) * grey if is_gain else grey + haze(x, y)
    found = fit_light(x, y, grey, target + noise, SHAPE, gain, offset)
    assert found is not None
    truth = wanted(is_gain=is_gain)
    before = float(np.sqrt(np.mean((truth[0] * 120.0 + truth[1] - 120.0) ** 2)))
    assert error_levels(found, gain, offset, truth) < min(0.7, 0.1 * before)


@pytest.mark.parametrize("is_gain", [True, False], ids=["vignette", "haze"])
def test_a_fifth_of_wrong_pairs_does_no_harm(is_gain: bool) -> None:
    x, y, grey, noise = pairs(2)
    target = shading(x, y) * grey if is_gain else grey + haze(x, y)
    rng = np.random.default_rng(3)
    wrong = rng.permutation(PAIRS) < PAIRS // 5
    target[wrong] = rng.uniform(40.0, 200.0, PAIRS // 5)
    found = fit_light(x, y, grey, target + noise, SHAPE, 1.0, 0.0)
    assert found is not None
    assert error_levels(found, 1.0, 0.0, wanted(is_gain=is_gain)) < 1.0


@settings(deadline=None, max_examples=30)
@given(
    seed=st.integers(0, 10_000),
    noise=st.floats(0.2, 8.0),
    gain=st.floats(0.7, 1.4),
    offset=st.floats(-10.0, 10.0),
)
def test_equal_light_needs_no_field(seed: int, noise: float, gain: float, offset: float) -> None:
    x, y, grey, errors = pairs(seed, noise)
    target = gain * grey + offset + errors
    assert fit_light(x, y, grey, target, SHAPE, gain, offset) is None


def test_few_pairs_tell_no_field() -> None:
    x, y, grey, _ = (values[:30] for values in pairs(1))
    assert fit_light(x, y, grey, shading(x, y) * grey, SHAPE, 1.0, 0.0) is None


def test_a_field_says_how_large_its_correction_is() -> None:
    x, y, grey, noise = pairs(4)
    found = fit_light(x, y, grey, grey + haze(x, y) + noise, SHAPE, 1.0, 0.0)
    assert found is not None
    assert found.rms_levels == pytest.approx(np.sqrt((haze(x, y) ** 2).mean()), rel=0.05)


def test_a_field_is_of_pictures_of_any_size() -> None:
    x, y, grey, noise = pairs(5)
    found = fit_light(x, y, grey, shading(x, y) * grey + noise, SHAPE, 1.0, 0.0)
    assert found is not None
    small = found.of(np.full(SHAPE, 100.0, np.float32))
    large = found.of(np.full((4 * SHAPE[0] - 3, 4 * SHAPE[1] - 3), 100.0, np.float32))
    assert large[::4, ::4] == pytest.approx(small, abs=1e-2)


PICTURE = (160, 200)
X_STEPS = np.array([0.0, -1.04, 0.97, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -0.98, 1.05])
RANGE_PX = (-6.0, 7.0)
SURFACES = [
    Surface(
        plane(-4.0, 0.012, 0.01), noise_texture(4, mean=115, contrast=24, finest_px=2), everywhere
    ),
    Surface(
        plane(4.0), noise_texture(5, mean=130, contrast=24, finest_px=2), disc((110.0, 80.0), 40.0)
    ),
]
VIGNETTES = (0.2, 0.4, 0.3, 0.2, 0.4)
"""Share of the light that is lost in the corners."""
CENTRES = ((0.0, 0.0), (0.4, 0.1), (-0.4, -0.2), (0.2, 0.4), (-0.1, -0.4))


@cache
def exact() -> Array:
    return render_views(SURFACES, PICTURE, X_STEPS, Y_STEPS, supersample=1)


@cache
def slopes(*, is_shaded: bool) -> SlopeMap:
    rows, columns = np.mgrid[0 : PICTURE[0], 0 : PICTURE[1]].astype(float)
    s, t = across(columns, rows, PICTURE)
    images = exact().copy()
    for image, lost, (right, down) in zip(images, VIGNETTES, CENTRES, strict=True):
        if is_shaded:
            image *= 1.0 - 0.5 * lost * ((s - right) ** 2 + (t - down) ** 2)
    views = RectifiedViews(expose(images, noise=1.0, seed=6), X_STEPS, Y_STEPS, 0)
    return estimate_slopes(views, RANGE_PX)


def test_vignettes_that_differ_cost_little() -> None:
    error = [
        np.abs(slopes(is_shaded=shaded).slope_px - true_slope_px(SURFACES, PICTURE))
        for shaded in (False, True)
    ]
    assert np.nanmedian(error[1]) < 1.5 * np.nanmedian(error[0])
    assert np.mean(~(error[1] < 0.5)) < np.mean(~(error[0] < 0.5)) + 0.02


def test_vignettes_that_differ_are_named() -> None:
    said = [text for text in slopes(is_shaded=True).warnings if text.startswith("light: ")]
    assert [text.split(" at ")[0] for text in said] == [f"light: view {i}" for i in (1, 2, 3, 4)]
    assert not any(text.startswith("light: ") for text in slopes(is_shaded=False).warnings)
    mending = slopes(is_shaded=False).mending
    assert mending is not None
    assert mending.light == ((None,) * 5,)
