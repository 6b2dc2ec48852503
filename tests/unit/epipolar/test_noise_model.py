"""The noise of a sensor with known read noise and gain, from the pictures of one instant."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar import NoiseModel, RectifiedViews, estimate_slopes
from rig.epipolar.noise.model import estimate_noise
from rig.errors import SlopeError
from tests.support.lightfield import (
    Array,
    Surface,
    disc,
    everywhere,
    expose_to_light,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)
from tests.unit.epipolar.conftest import Scene

ROWS, COLUMNS = np.mgrid[0:240, 0:320].astype(float)


def shaded() -> Array:
    """A textured wall, half of it in the shadow."""
    texture = noise_texture(5, mean=130, contrast=20, finest_px=3.0)(COLUMNS, ROWS)
    return texture * np.where(COLUMNS > 160, 1.4, 0.15)


@pytest.mark.parametrize(("read", "electrons"), [(0.7, 4.0), (1.0, 20.0), (0.3, 60.0)])
def test_gain_and_read_noise_are_told_by_one_picture(read: float, electrons: float) -> None:
    exact = shaded()[None]
    image = expose_to_light(
        exact, read_noise_levels=read, electrons_per_level=electrons, gain_spread=0.0, seed=1
    )[0]
    model, truth = estimate_noise([image.astype(np.float32)], 1.0), NoiseModel(read, electrons)
    for grey in (15.0, 60.0, 200.0):
        assert model.sigma_levels(grey) == pytest.approx(truth.sigma_levels(grey), rel=0.1)


def test_white_noise_stays_white_although_bright_parts_have_more_texture() -> None:
    noisy = shaded() + 2.0 * np.random.default_rng(2).standard_normal(ROWS.shape)
    model = estimate_noise([noisy.astype(np.float32)], 0.0)
    assert model.electrons_per_level == float("inf")
    assert model.read_noise_levels == pytest.approx(2.0, rel=0.1)


def test_a_small_picture_tells_only_how_much_noise_there_is() -> None:
    noisy = 50 + 3.0 * np.random.default_rng(3).standard_normal((40, 40))
    model = estimate_noise([noisy.astype(np.float32)], 0.0)
    assert model.electrons_per_level == float("inf")
    assert model.read_noise_levels == pytest.approx(3.0, rel=0.2)


@pytest.mark.parametrize("electrons", [2.0, 10.0, float("inf")])
def test_stabilised_grey_values_have_a_noise_of_one(electrons: float) -> None:
    model = NoiseModel(2.0, electrons)
    random = np.random.default_rng(4)
    for grey in (20.0, 80.0, 220.0):
        noisy = grey + model.sigma_levels(grey) * random.standard_normal((1, 300, 300))
        assert model.stabilised(noisy.astype(np.float32)).std() == pytest.approx(1.0, rel=0.05)


def test_stabilised_grey_values_keep_their_order_down_to_below_zero() -> None:
    grey = np.linspace(-20, 255, 500, dtype=np.float32).reshape(1, 1, -1)
    for model in (NoiseModel(0.0, 3.0, 0.0), NoiseModel(1.0, 3.0), NoiseModel(1.0)):
        stable = model.stabilised(grey)
        assert np.isfinite(stable).all()
        assert (np.diff(stable.ravel()) > 0).all()


@pytest.mark.parametrize(
    "values", [(-1.0, 3.0), (np.nan, 3.0), (1.0, 0.0), (1.0, np.nan), (1.0, 3.0, -1.0)]
)
def test_a_noise_that_cannot_be_is_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(SlopeError, match="as rig check measures"):
        NoiseModel(*values)


@pytest.fixture(scope="module")
def dim_and_bright() -> Scene:
    """A bright disc before a wall in the dark, taken by a sensor of 4 electrons per level."""
    wall, front = (noise_texture(k, mean=130, contrast=28, finest_px=1.8) for k in (9, 8))
    surfaces = [
        Surface(plane(-0.55, 0.0015), lambda u, v: 0.17 * wall(u, v), everywhere),
        Surface(plane(0.7), lambda u, v: 1.25 * front(u, v), disc((48.0, 36.0), 26.0)),
    ]
    arm, still = np.array([-4.0, -2.0, 2.0, 4.0]), np.zeros(4)
    x_steps, y_steps = np.r_[0.0, arm, still], np.r_[0.0, still, arm]
    exact = render_views(surfaces, (72, 96), x_steps, y_steps, supersample=2)
    frames = expose_to_light(
        exact, read_noise_levels=0.5, electrons_per_level=4.0, gain_spread=0.02, seed=3
    )
    views = RectifiedViews(frames, x_steps, y_steps, 0)
    return Scene(views, true_slope_px(surfaces, (72, 96)), (-2.0, 2.0))


@pytest.mark.slow
def test_bright_pixels_are_weighed_by_their_own_noise(dim_and_bright: Scene) -> None:
    views, range_px, true_px = (
        dim_and_bright.views,
        dim_and_bright.range_px,
        dim_and_bright.slope_px,
    )
    bright = true_px > 0

    def error_and_scatter(noise: NoiseModel | None) -> tuple[float, float, float]:
        found = estimate_slopes(views, range_px, noise=noise)
        error = np.abs(found.slope_px - true_px)
        dark_px, bright_px = (float(np.nanmedian(error[part])) for part in (~bright, bright))
        scatter = 1.4826 * float(np.nanmedian((error / found.sigma_px)[bright]))
        return dark_px, bright_px, scatter

    of_dark = NoiseModel(NoiseModel(0.5, 4.0).sigma_levels(22.0))
    dark_px, bright_px, _ = error_and_scatter(of_dark)
    for told in (None, NoiseModel(0.5, 4.0)):
        now = error_and_scatter(told)
        assert now[0] < dark_px
        assert now[1] < 0.7 * bright_px
        assert 0.4 < now[2] < 1.6


def test_the_argument_goes_before_the_noise_of_the_views(ball: Scene) -> None:
    views = replace(ball.views, noise=NoiseModel(30.0))
    with_argument = estimate_slopes(views, ball.range_px, noise=NoiseModel(1.0))
    without = estimate_slopes(ball.views, ball.range_px, noise=NoiseModel(1.0))
    assert with_argument.slope_px.tobytes() == without.slope_px.tobytes()
    coarse = estimate_slopes(views, ball.range_px)
    assert np.nanmedian(coarse.sigma_px) > 2 * np.nanmedian(with_argument.sigma_px)
