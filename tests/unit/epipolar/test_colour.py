"""Colour: texture that luminance cannot see, channels that tell nothing, grey in disguise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews, estimate_slopes
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
from tests.unit.epipolar.conftest import X_STEPS, Y_STEPS, Scene

SHAPE = (80, 104)
LUMINANCE = np.array([0.299, 0.587, 0.114])


@pytest.fixture(scope="module")
def even_brightness() -> Scene:
    """A disc before a wall, both of red and green texture of one luminance; blue tells nothing."""
    textures = [noise_texture(k, mean=0, contrast=26, finest_px=2.2) for k in (11, 12)]

    def surfaces(mean: float, share: float) -> list[Surface]:
        wall, front = ((lambda u, v, t=t: mean + share * t(u, v)) for t in textures)
        return [
            Surface(plane(-2.2, 0.01), wall, everywhere),
            Surface(plane(2.6), front, disc((56.0, 40.0), 25.0)),
        ]

    channels: list[NDArray[np.uint8]] = []
    for c, share in enumerate((1.0, -LUMINANCE[0] / LUMINANCE[1])):
        exact = render_views(surfaces(120.0, share), SHAPE, X_STEPS, Y_STEPS, supersample=1)
        channels.append(expose(exact, noise=1.0, gain_spread=0.02, seed=c))
    channels.append(np.full_like(channels[0], 77))
    views = RectifiedViews(np.stack(channels, axis=-1), X_STEPS, Y_STEPS, 1)
    return Scene(views, true_slope_px(surfaces(120.0, 1.0), SHAPE), (-4.0, 4.0))


def test_colour_tells_slopes_where_brightness_is_even(even_brightness: Scene) -> None:
    views, true_px = even_brightness.views, even_brightness.slope_px
    assert views.is_colour
    assert views.shape == SHAPE
    error = np.abs(estimate_slopes(views, even_brightness.range_px).slope_px - true_px)
    assert np.nanmedian(error) < 0.05
    assert np.nanmean(error > 0.5) < 0.08
    luminance = np.rint(views.images @ LUMINANCE).astype(np.uint8)
    grey = estimate_slopes(replace(views, images=luminance), even_brightness.range_px)
    lost = np.nan_to_num(np.abs(grey.slope_px - true_px), nan=np.inf) > 0.5
    assert lost.mean() > 0.3


def test_grey_in_three_channels_is_grey(ball: Scene) -> None:
    colour = replace(ball.views, images=np.repeat(ball.views.images[..., None], 3, axis=-1))
    assert not ball.views.is_colour
    found, grey = (estimate_slopes(v, ball.range_px) for v in (colour, ball.views))
    both = np.isfinite(found.slope_px) & np.isfinite(grey.slope_px)
    assert both.mean() > 0.99
    assert np.median(np.abs(found.slope_px - grey.slope_px)[both]) < 0.01
    assert np.median(found.sigma_px[both] / grey.sigma_px[both]) == pytest.approx(1.0, abs=0.2)


def test_a_black_view_in_colour_is_left_out_and_named(even_brightness: Scene) -> None:
    images = even_brightness.views.images.copy()
    images[3] = 0
    views = replace(even_brightness.views, images=images)
    found = estimate_slopes(views, even_brightness.range_px)
    assert len(found.warnings) == 1
    assert "view 3" in found.warnings[0]
    assert np.nanmedian(np.abs(found.slope_px - even_brightness.slope_px)) < 0.06
