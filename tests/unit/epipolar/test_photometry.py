import numpy as np
import pytest

from rig.epipolar.photometry import equalise
from rig.epipolar.window import Cameras, window_of
from tests.unit.epipolar.conftest import Scene


def test_gains_and_offsets_are_taken_out(ball: Scene) -> None:
    exact = ball.views.images.astype(np.float32)
    gains = np.array([1.05, 1.0, 0.95, 1.02, 0.97], np.float32)
    offsets = np.array([4.0, 0.0, -3.0, 2.0, 0.0], np.float32)
    cameras = Cameras(ball.views.x_steps, ball.views.y_steps, 1)
    window = window_of(ball.views.shape, ball.range_px, None)
    before = equalise(exact, cameras, window)
    after = equalise(exact * gains[:, None, None] + offsets[:, None, None], cameras, window)
    assert np.array_equal(after[1], exact[1])
    assert np.abs(after - before).mean() < 0.6
    assert float(after[0].mean()) == pytest.approx(float(before[0].mean()), abs=0.6)
