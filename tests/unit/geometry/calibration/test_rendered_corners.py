"""The benchmarks' rendered corners lie where their board is, edges along the rows included."""

import numpy as np
import pytest

from benchmarks.calibration_corners import Picture, corner_error_px, rendered_sightings
from tests.support.calibration_scene import BoardPose, Scene, TrueCamera


@pytest.mark.parametrize("roll_deg", [0.0, 0.5, 20.0])
def test_a_board_without_noise_is_found_where_it_is(roll_deg: float):
    """Square-on, so that all edges of a roll of 0 lie at one place between two rows of pixels."""
    poses = tuple(
        BoardPose((float(x), 0.13 * x, 640.0), (0.0, 0.0, roll_deg)) for x in np.linspace(0, 1, 5)
    )
    scene = Scene((TrueCamera((0.0, 0.0, 0.0)),), poses)
    found = rendered_sightings(scene, 1, Picture(blur_px=0.7, noise=0.05))
    assert sum(map(len, found)) == 5 * len(scene.board_mm())
    assert corner_error_px(scene, found) < 0.002
