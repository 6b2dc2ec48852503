"""A small cross of five views, at unequal fractional positions, of a scene with exact slopes."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews
from tests.support.lightfield import (
    Field,
    Surface,
    bump,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

X_STEPS = np.array([-1.04, 0.0, 0.97, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -0.98, 1.05])
SHAPE = (96, 128)


@dataclass(frozen=True)
class Scene:
    views: RectifiedViews
    slope_px: NDArray[np.float64]
    range_px: tuple[float, float]


def texture(seed: int, mean: float) -> Field:
    return noise_texture(seed, mean=mean, contrast=28.0, finest_px=2.0)


@pytest.fixture(scope="session")
def ball() -> Scene:
    """A ball that bulges out of a tilted wall behind the focus distance."""
    surfaces = [
        Surface(plane(-3.0, 0.01, 0.004), texture(1, 105.0), everywhere),
        Surface(bump((66.0, 46.0), 28.0, 3.0, 5.0), texture(2, 130.0), disc((66.0, 46.0), 28.0)),
    ]
    exact = render_views(surfaces, SHAPE, X_STEPS, Y_STEPS, supersample=2)
    frames = expose(exact, noise=1.0, gain_spread=0.02, seed=3)
    views = RectifiedViews(frames, X_STEPS, Y_STEPS, 1)
    return Scene(views, true_slope_px(surfaces, SHAPE), (-5.0, 7.0))
