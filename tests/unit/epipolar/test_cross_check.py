from dataclasses import replace

import numpy as np

from rig.epipolar import estimate_slopes
from rig.epipolar.search.cross_check import is_one_sided
from rig.epipolar.search.window import Cameras
from tests.unit.epipolar.conftest import Scene


def test_what_a_pair_hides_is_blind_or_unsure(ball: Scene) -> None:
    kept = [0, 1]
    views = replace(
        ball.views,
        images=ball.views.images[kept],
        x_steps=ball.views.x_steps[kept],
        y_steps=ball.views.y_steps[kept],
        reference=1,
    )
    slopes = estimate_slopes(views, ball.range_px)
    error = slopes.slope_px - ball.slope_px
    rows, columns = np.mgrid[0 : error.shape[0], 0 : error.shape[1]]
    ring = np.hypot(columns - 66, rows - 46)
    hidden = (ring > 29) & (ring < 36) & (np.abs(rows - 46) < 20) & (columns > 66)
    blind_px = (ball.range_px[1] - ball.range_px[0]) / 12**0.5
    answered = (slopes.label > 0) & (slopes.sigma_px <= 0.25 * blind_px)
    wrong = answered & (np.abs(error) > 0.5)
    assert wrong[hidden].mean() < 0.02
    assert wrong.mean() < 0.005
    assert answered.mean() > 0.8


def test_a_spare_half_needs_no_check() -> None:
    zero = np.zeros(3)
    assert is_one_sided(Cameras(np.array([0.0, 1.0, 2.0]), zero, 0))
    assert not is_one_sided(Cameras(np.array([0.0, 1.0, -1.0]), zero, 0))
    assert not is_one_sided(Cameras(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0))
