import numpy as np
import pytest
from rig_sim.scenes.place import ball, box, ellipse, rectangle, tube
from rig_sim.surface import Shape, cast

ORIGIN = np.zeros(3)
AHEAD = np.array([[0.0, 0.0, 1.0]])


def depth(shape: Shape, direction: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> float:
    return float(cast([shape], ORIGIN, np.array([direction]))[0][0])


def test_a_wall_is_met_at_its_distance_along_the_axis_whatever_the_slant_of_the_ray():
    wall = rectangle((0.0, 0.0, 500.0), (400.0, 0.0, 0.0), (0.0, 300.0, 0.0))
    assert depth(wall) == pytest.approx(500.0)
    assert depth(wall, (0.5, -0.3, 1.0)) == pytest.approx(500.0)
    assert depth(wall, (0.81, 0.0, 1.0)) == np.inf


def test_a_slanted_wall():
    wall = rectangle((0.0, 0.0, 500.0), (300.0, 0.0, 300.0), (0.0, 300.0, 0.0))
    # z = 500 + x and x = z tan: z = 500 / (1 - tan)
    assert depth(wall, (0.2, 0.0, 1.0)) == pytest.approx(500.0 / 0.8)


def test_an_ellipse_ends_at_its_half_axes():
    leaf = ellipse((0.0, 0.0, 100.0), (20.0, 0.0, 0.0), (0.0, 10.0, 0.0))
    assert depth(leaf, (0.199, 0.0, 1.0)) == pytest.approx(100.0)
    assert depth(leaf, (0.0, 0.101, 1.0)) == np.inf
    assert depth(leaf, (0.15, 0.08, 1.0)) == np.inf


def test_a_ball_is_met_in_front():
    assert depth(ball((0.0, 0.0, 800.0), 82.0, tilt_deg=20.0)) == pytest.approx(718.0)


def test_a_tube_is_met_on_its_mantle_between_its_ends_only():
    upright = tube((0.0, 50.0, 600.0), (0.0, -50.0, 600.0), 40.0)
    assert depth(upright) == pytest.approx(560.0)
    assert depth(upright, (0.0, 0.089, 1.0)) == pytest.approx(560.0)
    assert depth(upright, (0.0, 0.090, 1.0)) == np.inf


def test_the_inside_of_a_tube_is_met_where_its_front_is_cut_off():
    open_above = tube((0.0, 0.0, 560.0), (0.0, 100.0, 560.0), 40.0)
    from_above = np.array([0.0, -100.0, 0.0])
    # Over the front rim at z = 520 (y = -6.4), on to the back at z = 600 (y = 8).
    met = cast([open_above], from_above, np.array([[0.0, 0.18, 1.0]]))[0][0]
    assert met == pytest.approx(600.0)


def test_the_front_of_a_box_is_half_its_depth_nearer():
    sides = box((0.0, 50.0, 700.0), (120.0, 100.0, 80.0), yaw_deg=0.0)
    assert cast(sides, ORIGIN, AHEAD)[0][0] == pytest.approx(660.0)


def test_the_nearest_of_several_wins_and_is_named():
    far, near = (
        rectangle((0.0, 0.0, z), (400.0, 0.0, 0.0), (0.0, 300.0, 0.0)) for z in (900.0, 500.0)
    )
    distance, index = cast([far, near], ORIGIN, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]))
    assert distance.tolist() == [pytest.approx(500.0), np.inf]
    assert index.tolist() == [1, -1]
