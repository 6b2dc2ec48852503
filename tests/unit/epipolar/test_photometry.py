import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.mending.first_match import first_match
from rig.epipolar.mending.photometry import equalise
from rig.epipolar.search.window import Cameras, Window, window_of
from tests.unit.epipolar.conftest import Scene

Map = NDArray[np.float32]


def equal(images: Map, cameras: Cameras, window: Window) -> Map:
    return equalise(images, cameras, first_match(images, cameras, window)).images


def test_gains_and_offsets_are_taken_out(ball: Scene) -> None:
    exact = ball.views.images.astype(np.float32)
    gains = np.array([1.05, 1.0, 0.95, 1.02, 0.97], np.float32)
    offsets = np.array([4.0, 0.0, -3.0, 2.0, 0.0], np.float32)
    cameras = Cameras(ball.views.x_steps, ball.views.y_steps, 1)
    window = window_of(ball.views.shape, ball.range_px, None)
    before = equal(exact, cameras, window)
    after = equal(exact * gains[:, None, None] + offsets[:, None, None], cameras, window)
    assert np.array_equal(after[1], exact[1])
    assert np.abs(after - before).mean() < 0.6
    assert float(after[0].mean()) == pytest.approx(float(before[0].mean()), abs=0.6)


def test_clipped_pixels_do_not_bend_the_gains(ball: Scene) -> None:
    exact = ball.views.images.astype(np.float32)
    gains = np.array([1.1, 1.0, 1.1, 1.1, 1.1], np.float32)[:, None, None]
    cameras = Cameras(ball.views.x_steps, ball.views.y_steps, 1)
    window = window_of(ball.views.shape, ball.range_px, None)
    free = equal(exact, cameras, window)
    clipped = equal(np.minimum(exact * gains, 140.0), cameras, window)
    dim = (exact * gains < 130).all(axis=0)
    assert np.abs(np.median((clipped - free)[:, dim], axis=1)).max() < 1.0
