import numpy as np
from numpy.typing import NDArray

from rig.epipolar.mending.first_match import first_match
from rig.epipolar.mending.photometry import equalise
from rig.epipolar.rank import highest
from rig.epipolar.sampling import pad
from rig.epipolar.scales import measure_scales
from rig.epipolar.search.sides import choose_sides
from rig.epipolar.search.window import Cameras, window_of
from tests.unit.epipolar.conftest import Scene


def choose(scene: Scene, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
    cameras = Cameras(scene.views.x_steps, scene.views.y_steps, 1)
    window = window_of(scene.views.shape, scene.range_px, None)
    first = first_match(scene.views.images, cameras, window)
    images = equalise(scene.views.images, cameras, first).images
    movable = np.ones(slope_px.shape, np.bool_)
    splines = pad(images, cameras.x_steps, cameras.y_steps)
    scales = measure_scales(images, 1)
    return choose_sides(splines, images[1], slope_px, movable, cameras, scales)


def test_a_fattened_foreground_goes_back_to_its_edge(ball: Scene) -> None:
    truth = ball.slope_px.astype(np.float32)
    fat = highest(truth, 2)
    was_wrong = np.abs(fat - truth) > 1.0
    still_wrong = np.abs(choose(ball, fat) - truth) > 1.0
    assert was_wrong.sum() > 300
    assert still_wrong.sum() < 0.2 * was_wrong.sum()


def test_without_jumps_nothing_moves(ball: Scene) -> None:
    plane = np.tile(np.linspace(-1, 1, 128, dtype=np.float32), (96, 1))
    assert np.array_equal(choose(ball, plane), plane)
