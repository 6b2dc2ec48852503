"""Light of a scene against closed forms: open sky, a lamp, what stands in the way."""

from typing import get_args

import numpy as np
import pytest
from rig_sim.scenes import light
from rig_sim.scenes.light import (
    DAYLIGHT,
    LAMP,
    LAMP_CENTRE_MM,
    LAMP_HALF_MM,
    LAMP_REACH_MM,
    Thing,
    illuminate,
)
from rig_sim.scenes.place import ball, ellipse, rectangle, tube
from rig_sim.surface import Kind, Shape

WHITE = np.ones((4, 4), np.float32)
KINDS: tuple[Kind, ...] = get_args(Kind)
DOWN = np.array([0.0, 1.0, 0.0])


def table(height_mm: float, half_mm: float = 20.0) -> Shape:
    """A level square below the lamp; its upper side is the one that is seen."""
    x_mm, _, z_mm = LAMP_CENTRE_MM
    return rectangle((x_mm, height_mm, z_mm), (half_mm, 0.0, 0.0), (0.0, 0.0, -half_mm))


def light_on(shape: Shape, *others: Shape) -> np.ndarray:
    things = [Thing(one, lambda: WHITE) for one in (shape, *others)]
    return illuminate(things)[0].texture


def lamp_at(point_mm: np.ndarray, normal: np.ndarray) -> float:
    """Mean over nine points of the lamp, each with the inverse square of its distance."""
    third = 2.0 * LAMP_HALF_MM / 3.0
    total = 0.0
    for dx in (-third, 0.0, third):
        for dz in (-third, 0.0, third):
            away = np.add(LAMP_CENTRE_MM, (dx, 0.0, dz)) - point_mm
            distance_mm = float(np.linalg.norm(away))
            total += max(float(away @ normal), 0.0) / distance_mm**3 * LAMP_REACH_MM**2
    return total / 9.0


@pytest.mark.parametrize("below_mm", [500.0, LAMP_REACH_MM, 3000.0])
def test_a_level_square_below_the_lamp_has_all_daylight_and_the_lamps_inverse_square(
    below_mm: float,
):
    height_mm = LAMP_CENTRE_MM[1] + below_mm
    texture = light_on(table(height_mm))
    middle_mm = np.array([LAMP_CENTRE_MM[0], height_mm - 0.5, LAMP_CENTRE_MM[2]])
    expected = DAYLIGHT + LAMP * lamp_at(middle_mm, -DOWN)
    assert texture == pytest.approx(expected, rel=2e-3)


def test_light_on_white_is_near_full_scale_square_to_the_lamp():
    assert light_on(table(LAMP_CENTRE_MM[1] + LAMP_REACH_MM)).max() == pytest.approx(1.2, abs=0.04)


def test_the_side_that_is_turned_away_from_the_lamp_has_daylight_alone():
    x_mm, y_mm, z_mm = LAMP_CENTRE_MM
    underside = rectangle((x_mm, y_mm + 500.0, z_mm), (20.0, 0.0, 0.0), (0.0, 0.0, 20.0))
    assert light_on(underside) == pytest.approx(DAYLIGHT, rel=1e-5)


def test_a_roof_keeps_the_lamp_off_and_most_of_the_sky():
    height_mm = LAMP_CENTRE_MM[1] + 800.0
    roof = table(height_mm - 100.0, half_mm=5000.0)
    dark = light_on(table(height_mm), roof)
    # All of the sky is met at 100 mm over the cosine, which counts as a fifth of 500 mm or more.
    number = np.arange(20) + 0.5
    reach = np.minimum(99.5 / np.sqrt(1.0 - number / 20.0) / 500.0, 1.0)
    assert dark == pytest.approx(DAYLIGHT * reach.mean(), rel=1e-5)


def test_a_roof_over_half_of_the_lamp_leaves_a_part_of_its_light():
    x_mm, y_mm, z_mm = LAMP_CENTRE_MM
    square = rectangle((x_mm, y_mm + 800.0, z_mm), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    # Its edge lies under the middle row of the lamp, just beyond: two rows of three are kept off.
    edge_mm = 5.0
    roof = rectangle((x_mm + edge_mm - 400.0, y_mm + 20.0, z_mm), (400.0, 0, 0), (0, 0, -400.0))
    part = light_on(square, roof).mean()
    whole = light_on(square).mean()
    sky = light_on(square, rectangle((x_mm, y_mm + 20.0, z_mm), (400.0, 0, 0), (0, 0, -400.0)))
    share = (part - sky.mean()) / (whole - DAYLIGHT)
    assert share == pytest.approx(1.0 / 3.0, abs=0.05)


@pytest.mark.parametrize(
    ("shape", "columns", "rows"),
    [
        (rectangle((0, 0, 900.0), (320.0, 0, 0), (0, 160.0, 0)), 40, 20),
        (rectangle((0, 0, 900.0), (10.0, 0, 0), (0, 5.0, 0)), 4, 4),
        (rectangle((0, 0, 900.0), (5000.0, 0, 0), (0, 4000.0, 0)), 80, 80),
        (ellipse((0, 0, 900.0), (80.0, 0, 0), (0, 40.0, 0)), 5, 32),
        (ball((0, 0, 900.0), 80.0), 32, 16),
        (tube((0, 100.0, 900.0), (0, -60.0, 900.0), 80.0), 32, 10),
    ],
)
def test_a_surface_has_a_cell_every_sixteen_millimetres_within_bounds(
    shape: Shape, columns: int, rows: int
):
    points_mm, normals = light._cells(shape)
    assert points_mm.shape == normals.shape == (rows, columns, 3)
    assert np.linalg.norm(normals, axis=-1) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_points_of_a_unit_shape_have_the_coordinates_that_they_were_asked_by(kind: Kind):
    u, v = np.meshgrid([0.1, 0.3, 0.45], [0.15, 0.25, 0.4])
    points, normals = light._parametrised(Shape(kind, np.eye(4)), u, v)
    x, y, z = np.moveaxis(points, -1, 0)
    turn = np.arctan2(y, x) / (2.0 * np.pi)
    match kind:
        case "rectangle":
            found, flat = ((x + 1.0) / 2.0, (y + 1.0) / 2.0), (z, 0.0)
        case "disk":
            found, flat = (np.hypot(x, y), turn), (z, 0.0)
        case "sphere":
            found, flat = (turn, np.arccos(z) / np.pi), (np.linalg.norm(points, axis=-1), 1.0)
        case "cylinder":
            found, flat = (turn, z), (np.hypot(x, y), 1.0)
    assert found[0] == pytest.approx(u)
    assert found[1] == pytest.approx(v)
    assert flat[0] == pytest.approx(np.full(u.shape, flat[1]))
    outwards = (
        points * (1.0, 1.0, kind == "sphere") if kind in ("sphere", "cylinder") else (0, 0, 1)
    )
    assert normals == pytest.approx(np.broadcast_to(outwards, normals.shape))


def test_normals_point_out_of_round_things_and_to_the_seen_side_of_flat_ones():
    globe = ball((10.0, 20.0, 900.0), 50.0, tilt_deg=20.0)
    points_mm, normals = light._cells(globe)
    assert points_mm - (10.0, 20.0, 900.0) == pytest.approx(50.0 * normals)
    wall = rectangle((0, 0, 900.0), (30.0, 0, 0), (0, 30.0, 0))
    assert light._cells(wall)[1] == pytest.approx(np.broadcast_to((0.0, 0.0, -1.0), (4, 4, 3)))


def test_light_is_spread_over_the_texels_and_multiplies_what_they_reflect():
    reflectance = np.arange(32, dtype=np.float32).reshape(4, 8) / 32.0
    painted = light._painted(reflectance, np.full((2, 3), 0.5))
    assert painted == pytest.approx(0.5 * reflectance)
    ramp = light._painted(np.ones((2, 4), np.float32), np.array([[0.0, 1.0]]))
    assert ramp[0] == pytest.approx([0.0, 0.25, 0.75, 1.0])
