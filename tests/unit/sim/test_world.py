import numpy as np
import pytest
from rig_sim.clock import VirtualClock
from rig_sim.optics import Array
from rig_sim.world import World

from rig.errors import ConfigError
from tests.support.cameras import SMALL, Slide, SmallRig


def centre_px(rig: SmallRig, view: int) -> Array:
    moment = rig.world.moment(0.0)
    assert moment.board is not None
    return moment.cameras[view].pixels(np.asarray(moment.board.centre_mm))


@pytest.mark.parametrize("travelled_mm", [-803.0, -503.0, -3.0])
def test_views_see_the_board_shifted_by_slope_times_their_place(travelled_mm: float):
    rig = SmallRig(slide=Slide(travelled_mm))
    slope_px = rig.world.true_slope_px(rig.world.true_distance_mm(0.0))
    for number, view in enumerate(rig.profile.views):
        shift_px = centre_px(rig, number) - centre_px(rig, 0)
        expected_px = [-slope_px * view.x_steps, -slope_px * view.y_steps]
        np.testing.assert_allclose(shift_px, expected_px, atol=1e-9)


def test_slope_is_zero_at_the_focus_distance_and_positive_before_it():
    world = SmallRig().world
    assert world.true_slope_px(world.focus_mm) == pytest.approx(0.0, abs=1e-12)
    assert (
        world.true_slope_px(world.focus_mm - 1.0) > 0.0 > world.true_slope_px(world.focus_mm + 1.0)
    )


def test_distance_is_where_the_carriage_put_the_board():
    assert SmallRig(slide=Slide(-603.0)).world.true_distance_mm(0.0) == pytest.approx(600.0)


def test_a_slanted_axis_moves_the_board_sideways_and_costs_distance():
    rig = SmallRig(("world.carriage.axis_deg=[1.0, -2.0]",), slide=Slide(-1000.0))
    board = rig.world.moment(0.0).board
    assert board is not None
    right, down = np.tan(np.radians([1.0, -2.0]))
    length = np.sqrt(1.0 + right**2 + down**2)
    assert board.centre_mm == pytest.approx(
        (-1000.0 * right / length, -1000.0 * down / length, 1203.0 - 1000.0 / length), abs=1e-3
    )


def test_a_motion_below_the_grid_changes_nothing_and_one_above_does():
    rig = SmallRig(slide=Slide(-603.0))
    at_rest = rig.world.moment(0.0)
    rig.slide.at_mm = -603.0002
    assert rig.world.moment(0.0) == at_rest
    rig.slide.at_mm = -603.001
    assert rig.world.moment(0.0) != at_rest


def test_the_grid_of_positions_moves_no_picture_by_a_ten_thousandth_of_a_pixel():
    world = SmallRig().world
    half_grid_mm = 0.00025
    moved_px = world.true_slope_px(400.0) - world.true_slope_px(400.0 + half_grid_mm)
    assert 0.0 < moved_px < 1e-4


def test_the_world_warms_and_the_focal_length_follows():
    rig = SmallRig(
        (
            "world.temperature.rise_degc=10.0",
            "world.temperature.time_s=100.0",
            "world.optics.focal_drift_ppm_per_degc=50.0",
        )
    )
    assert rig.world.temperature_degc(0.0) == pytest.approx(25.0)
    assert rig.world.temperature_degc(100.0) == pytest.approx(25.0 + 10.0 * (1.0 - np.exp(-1.0)))
    cold, warm = (rig.world.moment(t_s).cameras[1] for t_s in (0.0, 10_000.0))
    assert warm.focal_px == pytest.approx(cold.focal_px * (1.0 + 500e-6), abs=5e-4)
    # The sensor is bolted in place: the principal point does not follow.
    assert warm.centre_px == cold.centre_px


def test_depth_of_the_board_scene_is_the_board_in_the_middle_and_the_wall_around():
    rig = SmallRig(slide=Slide(-603.0))
    depth_mm = rig.world.true_depth_mm()
    assert depth_mm[200, 320] == pytest.approx(600.0)
    assert depth_mm[5, 5] == pytest.approx(1400.0)


def test_depth_of_a_tilted_board_follows_its_plane():
    rig = SmallRig(("world.board_tilt_deg=[0.0, 10.0]",), slide=Slide(-603.0))
    depth_mm = rig.world.true_depth_mm()[200]
    x = (np.arange(640) - 319.5) / 610.0
    # Turned about y by +10 degrees the right side comes nearer: z = 600 - X tan, X = x z.
    expected_mm = 600.0 / (1.0 + x * np.tan(np.radians(10.0)))
    np.testing.assert_allclose(depth_mm[250:390], expected_mm[250:390], rtol=1e-9)


def test_depth_is_measured_from_the_true_reference_camera():
    turned = SmallRig(("world.view_errors.centre={rotation_deg=[0.0, 3.0, 0.0]}",))
    assert turned.world.true_distance_mm(0.0) == pytest.approx(600.0 * np.cos(np.radians(3.0)))


def test_the_desk_fills_the_calibrated_range():
    rig = SmallRig(SMALL, scene="desk")
    depth_mm = rig.world.true_depth_mm()
    assert np.mean((depth_mm > 420.0) & (depth_mm < 1180.0)) > 0.93
    assert np.isfinite(depth_mm).all()
    with pytest.raises(ConfigError, match="no board"):
        rig.world.true_distance_mm(0.0)


def test_a_board_scene_needs_a_target():
    rig = SmallRig()
    with pytest.raises(ConfigError, match=r"\[target\]"):
        World(
            rig.profile.model_copy(update={"target": None}),
            clock=VirtualClock(),
            carriage=Slide(),
            scene="board",
        )
