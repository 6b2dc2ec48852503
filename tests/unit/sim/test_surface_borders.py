"""Where rays meet shapes, at the very borders, and things placed by their numbers."""

import numpy as np
import pytest
from rig_sim.scenes.place import ball, box, rectangle, tube
from rig_sim.surface import Shape, cast

UNIT = np.eye(4)


def met(shape: Shape, start: tuple[float, ...], along: tuple[float, ...]) -> float:
    return float(cast([shape], np.array(start), np.array([along]))[0][0])


@pytest.mark.parametrize(
    ("kind", "x", "y", "is_met"),
    [
        ("rectangle", 1.0, 1.0, True),
        ("rectangle", -1.0, -1.0, True),
        ("rectangle", 1.001, 0.0, False),
        ("rectangle", 0.0, -1.001, False),
        ("disk", 1.0, 0.0, True),
        ("disk", 0.0, -1.0, True),
        ("disk", 0.8, 0.8, False),
        ("disk", 0.6, 0.7, True),
    ],
)
def test_flat_shapes_end_at_one_and_the_border_belongs_to_them(
    kind: str, x: float, y: float, is_met: bool
):
    shape = Shape("disk" if kind == "disk" else "rectangle", UNIT)
    expected = 5.0 if is_met else np.inf
    assert met(shape, (x, y, -5.0), (0.0, 0.0, 1.0)) == expected
    assert met(shape, (x, y, -5.0), (0.0, 0.0, 0.5)) == 2.0 * expected
    assert met(shape, (x, y, -5.0), (0.0, 0.0, -1.0)) == np.inf, "behind the start"


def test_a_ray_that_begins_on_a_surface_does_not_meet_it_there():
    assert met(Shape("rectangle", UNIT), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)) == np.inf
    assert met(Shape("sphere", UNIT), (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)) == 2.0
    assert met(Shape("cylinder", UNIT), (-1.0, 0.0, 0.5), (1.0, 0.0, 0.0)) == 2.0


def test_a_sphere_is_met_where_the_quadratic_says():
    # At x = 0.6 its front is at z = -0.8; from inside only the far wall is met.
    sphere = Shape("sphere", UNIT)
    assert met(sphere, (0.6, 0.0, -5.0), (0.0, 0.0, 1.0)) == pytest.approx(4.2)
    assert met(sphere, (0.6, 0.0, -5.0), (0.0, 0.0, 2.0)) == pytest.approx(2.1)
    assert met(sphere, (0.6, 0.0, 0.0), (0.0, 0.0, 1.0)) == pytest.approx(0.8)
    assert met(sphere, (0.0, 0.36, -5.0), (0.0, 0.12, 1.0)) == pytest.approx(
        (4.9568 - np.sqrt(4.9568**2 - 1.0144 * 24.1296)) / 1.0144
    )
    assert met(sphere, (0.0, 0.0, 5.0), (0.0, 0.0, 1.0)) == np.inf
    assert met(sphere, (1.01, 0.0, -5.0), (0.0, 0.0, 1.0)) == np.inf


@pytest.mark.parametrize(
    ("z", "distance"), [(0.0, 4.2), (1.0, 4.2), (-0.001, np.inf), (1.001, np.inf)]
)
def test_a_cylinder_ends_at_0_and_1_and_both_ends_belong_to_it(z: float, distance: float):
    found = met(Shape("cylinder", UNIT), (-5.0, 0.6, z), (1.0, 0.0, 0.0))
    assert found == pytest.approx(distance)


def test_a_slanted_ray_through_an_open_end_meets_the_far_wall():
    # It crosses x = -1 at z = -0.5, below the mantle, and x = 1 at z = 0.5.
    cylinder = Shape("cylinder", UNIT)
    assert met(cylinder, (-2.0, 0.0, -1.0), (1.0, 0.0, 0.5)) == pytest.approx(3.0)


def test_of_two_shapes_at_one_place_the_first_is_seen():
    wall = rectangle((0.0, 0.0, 9.0), (5.0, 0.0, 0.0), (0.0, 5.0, 0.0))
    distance, index = cast([wall, wall], np.zeros(3), np.array([[[0.0, 0.0, 1.0]]]))
    assert distance.shape == index.shape == (1, 1)
    assert (distance[0, 0], index[0, 0]) == (9.0, 0)


def test_every_ray_may_have_its_own_start():
    wall = rectangle((0.0, 0.0, 9.0), (5.0, 0.0, 0.0), (0.0, 5.0, 0.0))
    starts = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 4.0]])
    ahead = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    assert cast([wall], starts, ahead)[0].tolist() == [8.0, 5.0]


def test_the_sides_of_a_turned_box_are_where_their_middles_say():
    foot, (width, height, depth) = np.array([10.0, 150.0, 700.0]), (120.0, 100.0, 80.0)
    front, left, right, top = (
        side.world_from_unit
        for side in box((10.0, 150.0, 700.0), (width, height, depth), yaw_deg=30.0)
    )
    cos, sin = np.cos(np.radians(30.0)), 0.5
    along, away = np.array([cos, 0.0, -sin]), np.array([sin, 0.0, cos])
    middle = foot - (0.0, 50.0, 0.0)
    assert front[:3, 3] == pytest.approx(middle - 40.0 * away)
    assert left[:3, 3] == pytest.approx(middle - 60.0 * along)
    assert right[:3, 3] == pytest.approx(middle + 60.0 * along)
    assert top[:3, 3] == pytest.approx(middle - (0.0, 50.0, 0.0))
    halves = [
        [np.linalg.norm(side[:3, axis]) for axis in (0, 1)] for side in (front, left, right, top)
    ]
    assert np.array(halves) == pytest.approx(np.array([[60, 50], [40, 50], [40, 50], [60, 40]]))
    for side, outwards in ((front, -away), (left, -along), (right, along), (top, (0.0, -1.0, 0.0))):
        # Flat things are seen from the negative side of their normal.
        assert -side[:3, 2] / np.linalg.norm(side[:3, 2]) == pytest.approx(np.array(outwards))


def test_a_ball_has_its_pole_above_tilted_to_the_right_and_its_seam_behind():
    matrix = ball((1.0, 2.0, 3.0), 50.0, tilt_deg=30.0).world_from_unit
    assert matrix[:3, 0] == pytest.approx([0.0, 0.0, 50.0])
    assert np.abs(matrix[:3, 2]) == pytest.approx([25.0, 50.0 * np.cos(np.radians(30.0)), 0.0])
    assert matrix[0, 2] * matrix[1, 2] < 0.0, "above is towards -y"
    assert matrix[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert matrix[3].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert np.linalg.det(matrix) == pytest.approx(50.0**3)


def test_a_tube_runs_from_its_start_to_its_end():
    matrix = tube((0.0, 50.0, 600.0), (0.0, -30.0, 600.0), 40.0).world_from_unit
    assert matrix[:3, 2].tolist() == [0.0, -80.0, 0.0]
    assert matrix[:3, 3].tolist() == [0.0, 50.0, 600.0]
    assert matrix[:3, 0] == pytest.approx([0.0, 0.0, 40.0])
    assert np.linalg.norm(matrix[:3, 1]) == pytest.approx(40.0)
    assert np.linalg.det(matrix) > 0.0
