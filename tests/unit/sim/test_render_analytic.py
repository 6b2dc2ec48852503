import numpy as np
import pytest
from rig_sim.board import INK, PAPER, Board
from rig_sim.optics import TrueCamera
from rig_sim.render_analytic import AnalyticRenderer

from rig.errors import ConfigError
from tests.support.cameras import SMALL, Slide, SmallRig

FINE = 32


def brute_force(camera: TrueCamera, board: Board, x_px: int, y_px: int) -> float | None:
    """Mean light over a pixel from many rays on a grid; None where the board ends in it."""
    places = (np.arange(FINE) + 0.5) / FINE - 0.5
    rays = camera.directions(*np.meshgrid(x_px + places, y_px + places)) @ camera.rotation.T
    start = np.asarray(camera.position_mm) - np.asarray(board.centre_mm)
    normal = board.rotation[:, 2]
    met = (start - (start @ normal) / (rays @ normal)[..., None] * rays) @ board.rotation[:, :2]
    if np.any(np.abs(met) > board.half_size_mm):
        return None
    counts = np.array([board.columns + 1, board.rows + 1])
    square = np.floor(met / board.square_mm + counts / 2.0)
    chequered = np.all((square >= 0) & (square < counts), axis=-1)
    return float(np.where(chequered & (square.sum(axis=-1) % 2 == 0), INK, PAPER).mean())


@pytest.mark.parametrize("profile", ["sim", "sim-real"])
def test_pixels_hold_the_light_that_falls_on_their_area(profile: str):
    rig = SmallRig((*SMALL, "world.board_tilt_deg=[12.0, -17.0]"), profile, slide=Slide(-800.0))
    moment = rig.world.moment(0.0)
    assert moment.board is not None
    pictures = np.stack(AnalyticRenderer().render(moment))
    random = np.random.default_rng(1)
    checked = 0
    for _ in range(300):
        view, x_px, y_px = random.integers(5), random.integers(40, 120), random.integers(25, 75)
        expected = brute_force(moment.cameras[view], moment.board, int(x_px), int(y_px))
        if expected is not None:
            checked += 1
            # Three samples of 64 are the accuracy of an edge.
            assert pictures[view, y_px, x_px] == pytest.approx(expected, abs=0.65 / 64 * 3.0)
    assert checked > 200


def test_a_board_half_outside_the_picture_is_drawn_as_far_as_it_goes():
    rig = SmallRig((*SMALL, "world.board_offset_mm=[190.0, 0.0]"))
    picture = AnalyticRenderer().render(rig.world.moment(0.0))[0]
    assert np.isclose(picture[50, 159], [INK, PAPER], atol=0.01).any()
    assert not np.isclose(picture[50, 5], [INK, PAPER], atol=0.05).any()


def test_a_board_outside_the_picture_leaves_the_bench():
    pictures = [
        np.stack(AnalyticRenderer().render(SmallRig((*SMALL, override)).world.moment(0.0)))
        for override in (
            "world.board_offset_mm=[5000.0, 0.0]",
            "world.board_offset_mm=[0.0, 9000.0]",
        )
    ]
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_nothing_is_saturated_or_black():
    picture = np.stack(AnalyticRenderer().render(SmallRig(SMALL).world.moment(0.0)))
    assert picture.min() > 0.05
    assert picture.max() < 0.9


def test_another_scene_is_refused():
    rig = SmallRig(SMALL, scene="desk")
    with pytest.raises(ConfigError, match=r'world\.renderer = "mitsuba"'):
        np.stack(AnalyticRenderer().render(rig.world.moment(0.0)))
