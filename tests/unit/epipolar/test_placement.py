"""Errors of the view positions: found where there are some, none where there are none."""

from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar import RectifiedViews, estimate_slopes
from rig.epipolar.placement import Placement, on_their_lines
from rig.epipolar.placement_fit import find_placement
from rig.epipolar.window import Cameras
from rig.errors import SlopeError
from tests.support.lightfield import (
    Surface,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)
from tests.unit.epipolar.conftest import X_STEPS, Y_STEPS, Scene

PLACES = np.stack([X_STEPS, Y_STEPS], axis=1)
SHAPE, REFERENCE = (144, 184), 1


def without_factor(errors: np.ndarray) -> np.ndarray:
    """Take the part in proportion to the positions away, which no match can know."""
    return errors - PLACES * (errors * PLACES).sum() / (PLACES**2).sum()


STEPS = 2 * without_factor(
    np.array([[0.012, 0.0], [0.0, 0.0], [0.012, 0.02], [-0.02, 0.01], [0.0, 0.0095]])
)


@pytest.fixture(scope="module")
def wall() -> Scene:
    surfaces = [
        Surface(
            plane(-4.0, 0.03, 0.02),
            noise_texture(4, mean=115, contrast=28, finest_px=2.0),
            everywhere,
        ),
        Surface(
            plane(5.0),
            noise_texture(5, mean=140, contrast=28, finest_px=2.0),
            disc((90.0, 60.0), 34.0),
        ),
    ]
    exact = render_views(surfaces, SHAPE, X_STEPS, Y_STEPS, supersample=1)
    frames = expose(exact, noise=1.0, gain_spread=0.0, seed=6)
    views = RectifiedViews(frames, X_STEPS, Y_STEPS, REFERENCE)
    return Scene(views, true_slope_px(surfaces, SHAPE), (-6.0, 7.0))


def place(scene: Scene, views: RectifiedViews) -> Placement:
    images = views.images.astype(np.float32)
    hidden = np.zeros(images.shape, np.bool_)
    cameras = Cameras(views.x_steps, views.y_steps, views.reference)
    found = find_placement(images, scene.slope_px.astype(np.float32), hidden, cameras, 1.0)
    assert found is not None
    return found


def test_nothing_is_found_where_the_views_are_where_they_are_told(wall: Scene) -> None:
    found = place(wall, wall.views)
    assert not found.misplaced.any()
    assert found.distance_px.max() < 0.03
    assert estimate_slopes(wall.views, wall.range_px).placement is None


def test_wrong_positions_are_found_to_their_sigma(wall: Scene) -> None:
    told = PLACES - STEPS
    views = replace(wall.views, x_steps=told[:, 0], y_steps=told[:, 1])
    found = place(wall, views)
    assert found.misplaced.tolist() == [True, False, True, True, True]
    assert np.abs(found.steps - STEPS).max() < 0.006
    assert np.abs(found.beside_px).max() < 0.02
    assert not place(wall, views.placed(found)).misplaced.any()


def test_pictures_beside_their_lines_are_found_and_brought_back(wall: Scene) -> None:
    beside_px = without_factor(
        np.array([[0.1, -0.12], [0.0, 0.0], [0.1, 0.08], [-0.15, 0.05], [0.0, 0.05]])
    )
    moved = on_their_lines(wall.views.images.astype(np.float32), -beside_px)
    found = place(wall, replace(wall.views, images=moved))
    assert np.abs(found.beside_px - beside_px).max() < 0.03
    assert not place(
        wall, replace(wall.views, images=on_their_lines(moved, found.beside_px))
    ).misplaced.any()


def test_a_common_factor_of_the_positions_is_not_guessed(wall: Scene) -> None:
    larger = replace(wall.views, x_steps=1.01 * X_STEPS, y_steps=1.01 * Y_STEPS)
    scaled = replace(wall, slope_px=wall.slope_px / 1.01)
    assert not place(scaled, larger).misplaced.any()


def test_slopes_are_better_where_the_views_are_than_where_they_are_told(wall: Scene) -> None:
    told = PLACES - STEPS
    views = replace(wall.views, x_steps=told[:, 0], y_steps=told[:, 1])
    found = estimate_slopes(views, wall.range_px)
    assert found.placement is not None
    assert any("view 3" in text and "calibrate the rig" in text for text in found.warnings)
    right = estimate_slopes(wall.views, wall.range_px)
    errors = [np.nanmedian(np.abs(m.slope_px - wall.slope_px)) for m in (right, found)]
    assert errors[1] < 1.3 * errors[0]
    again = estimate_slopes(views.placed(found.placement), wall.range_px)
    assert again.placement is None
    assert again.warnings == ()


def test_a_pair_too_many_views_and_pictures_without_texture_tell_no_places(wall: Scene) -> None:
    images = wall.views.images.astype(np.float32)
    slope = wall.slope_px.astype(np.float32)
    pair, all_of_them = Cameras(X_STEPS[:2], Y_STEPS[:2], 1), Cameras(X_STEPS, Y_STEPS, REFERENCE)
    hidden = np.zeros(images.shape, np.bool_)
    assert find_placement(images[:2], slope, hidden[:2], pair, 1.0) is None
    many = Cameras(np.tile(X_STEPS, 7), np.tile(Y_STEPS, 7), REFERENCE)
    stack = np.tile(images, (7, 1, 1))
    assert find_placement(stack, slope, np.zeros(stack.shape, np.bool_), many, 1.0) is None
    assert find_placement(np.full_like(images, 90.0), slope, hidden, all_of_them, 1.0) is None


@pytest.mark.parametrize("shift_px", [(0.3, 0.0), (-0.15, 0.4), (1.2, -0.7)])
def test_a_picture_is_moved_without_losing_its_texture(shift_px: tuple[float, float]) -> None:
    rows, columns = np.mgrid[0:60, 0:70].astype(float)
    texture = noise_texture(3, mean=100, contrast=20, finest_px=3.0)
    moved = on_their_lines(texture(columns, rows)[None].astype(np.float32), np.array([shift_px]))
    exact = texture(columns + shift_px[0], rows + shift_px[1])
    assert np.abs(moved[0] - exact)[8:-8, 8:-8].max() < 1.0


def test_displacements_of_another_number_of_pictures_are_refused(wall: Scene) -> None:
    with pytest.raises(SlopeError, match=r"\(3, 2\) of 5 pictures"):
        replace(wall.views, beside_px=np.zeros((3, 2)))
    with pytest.raises(SlopeError, match="finite"):
        replace(wall.views, beside_px=np.full((5, 2), np.nan))
