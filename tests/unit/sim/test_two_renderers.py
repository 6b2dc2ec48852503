"""Both renderers on pictures of a few pixels: against each other, and against many rays per pixel.

The slow tests measure corners to a hundredth of a pixel; here a board that lies elsewhere, or a
wrong light, is seen in a second.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rig_sim.board import INK, PAPER
from rig_sim.render_analytic import AnalyticRenderer
from rig_sim.render_mitsuba import MitsubaRenderer
from rig_sim.world import Moment

from tests.support.cameras import Slide, SmallRig

TINY = ("camera.width_px=48", "camera.height_px=36", "world.optics.focal_px=45.0")
TILTED = "world.board_tilt_deg=[10.0, -15.0]"
CHARUCO = (
    'target={kind="charuco", squares_across=8, squares_down=6, square_mm=28.0, marker_mm=21.0,'
    ' dictionary="4X4_50"}'
)
FINE = 24


@cache
def moment(profile: str, *overrides: str, travelled_mm: float = -803.0) -> Moment:
    rig = SmallRig((*TINY, *overrides), profile, slide=Slide(travelled_mm))
    return rig.world.moment(0.0)


@pytest.mark.parametrize(
    ("profile", "overrides", "mean", "most"),
    [
        ("sim", (TILTED,), 0.009, 0.1),
        ("sim", (CHARUCO,), 0.009, 0.1),
        ("sim-real", (TILTED,), 0.017, 0.18),
    ],
)
def test_a_traced_board_is_the_drawn_one(
    profile: str, overrides: tuple[str, ...], mean: float, most: float
):
    seen = moment(profile, *overrides)
    traced = np.stack(MitsubaRenderer(samples_per_px=64, seed=1).render(seen))
    error = np.abs(traced - np.stack(AnalyticRenderer().render(seen)))
    assert error.shape == (5, 36, 48)
    assert error.mean() < mean
    assert error.max() < most
    # Whole pixels of ink and paper have exactly their light.
    assert traced.min() == pytest.approx(INK, abs=1e-3)
    assert traced.max() == pytest.approx(PAPER, abs=1e-3)


def test_what_is_behind_the_board_is_kept_as_long_as_no_camera_moves():
    renderer = MitsubaRenderer(samples_per_px=16, seed=1)
    seen = moment("sim")
    nearer, moved = moment("sim", travelled_mm=-903.0), moment("sim", "world.optics.focal_px=60.0")
    first = np.stack(renderer.render(seen))
    for other in (nearer, moved, seen):
        assert (
            np.abs(
                np.stack(renderer.render(other)) - np.stack(AnalyticRenderer().render(other))
            ).mean()
            < 0.012
        )
    np.testing.assert_array_equal(np.stack(renderer.render(seen)), first)


def test_without_a_board_the_wall_and_the_bench_are_seen():
    seen = moment("sim")
    away = moment("sim", "world.board_offset_mm=[5000.0, 0.0]")
    empty = replace(seen, board=None)
    assert np.stack(AnalyticRenderer().render(away)).max() < 0.5
    for without in (empty, away):
        traced = np.stack(MitsubaRenderer(samples_per_px=16, seed=1).render(without))
        assert np.abs(traced - np.stack(AnalyticRenderer().render(away))).mean() < 0.012


def test_a_renderer_is_named_by_all_that_its_pictures_depend_on():
    name = MitsubaRenderer(samples_per_px=7, seed=3).name
    assert name.startswith("mitsuba ")
    assert name.endswith(", 7 samples per px, seed 3")


@pytest.mark.slow
@pytest.mark.parametrize("overrides", [(), (TILTED,), ("world.board_margin_mm=3.0",)])
def test_pixels_at_the_end_of_the_paper_hold_their_share_of_it(overrides: tuple[str, ...]):
    seen = moment("sim", *overrides)
    seen = replace(seen, cameras=seen.cameras[:2])
    board = seen.board
    assert board is not None
    drawn = np.stack(AnalyticRenderer().render(seen))
    behind = np.stack(
        AnalyticRenderer().render(moment("sim", "world.board_offset_mm=[5000.0, 0.0]"))
    )
    places = (np.arange(FINE) + 0.5) / FINE - 0.5
    ends = 0
    for view, camera in enumerate(seen.cameras):
        x_px, y_px = camera.pixel_grid()
        rays = camera.directions(
            x_px[..., None, None] + places, y_px[..., None, None] + places[:, None]
        )
        start = board.rotation.T @ (np.asarray(camera.position_mm) - np.asarray(board.centre_mm))
        along = rays @ camera.rotation @ board.rotation
        met = start[:2] - start[2] / along[..., 2:] * along[..., :2]
        half = np.array(board.squares_across) * board.square_mm / 2.0
        on_paper = np.all(np.abs(met) <= half + board.margin_mm, axis=-1)
        square = np.floor((met + half) / board.square_mm).astype(int)
        is_ink = np.all(np.abs(met) <= half, axis=-1) & (square.sum(axis=-1) % 2 == 0)
        light = np.where(is_ink, INK, PAPER) * on_paper
        cover = on_paper.mean(axis=(2, 3))
        expected = light.mean(axis=(2, 3)) + (1.0 - cover) * behind[view]
        ends += np.count_nonzero((cover > 0.0) & (cover < 1.0))
        assert np.abs(drawn[view] - expected).max() < 0.045
        assert np.abs(drawn[view] - expected).mean() < 0.003
    assert ends > 60
