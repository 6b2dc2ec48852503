from dataclasses import replace

import numpy as np

from rig.epipolar import estimate_slopes
from rig.epipolar.cross_check import is_one_sided
from rig.epipolar.window import Cameras
from tests.unit.epipolar.conftest import Scene


def test_what_a_pair_hides_is_blind_or_takes_the_farther_slope(ball: Scene) -> None:
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
    with np.errstate(invalid="ignore"):
        assert (np.abs(error[hidden]) > 0.5).mean() < 0.2
    assert np.isnan(error[hidden]).mean() > 0.5


def test_a_spare_half_needs_no_check() -> None:
    zero = np.zeros(3)
    assert is_one_sided(Cameras(np.array([0.0, 1.0, 2.0]), zero, 0))
    assert not is_one_sided(Cameras(np.array([0.0, 1.0, -1.0]), zero, 0))
    assert not is_one_sided(Cameras(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0))
