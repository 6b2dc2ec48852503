"""Errors of the view positions: found where there are some, none where there are none, and borne
honestly where no match can know them."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from rig.epipolar import RectifiedViews, estimate_slopes
from rig.epipolar.placement.equations import Lines
from rig.epipolar.placement.fit import find_placement
from rig.epipolar.placement.placement import Placement, on_their_lines
from rig.epipolar.placement.solve import slope_variance
from rig.epipolar.search.window import Cameras
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


ARM = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
CROSS = np.stack([np.r_[0.0, ARM, 0.0 * ARM], np.r_[0.0, 0.0 * ARM, ARM]])
CROSS_PX = 0.27
"""Of the cross, one step is worth this many px of what it is with the five views."""
ROW = np.array([[-2.1, -1.0, 0.0, 0.9, 2.0], [0.0, 0.0, 0.0, 0.0, 0.0]])


def surfaces_of(per_step_px: float) -> list[Surface]:
    """A tilted wall with a disc before it."""
    texture = partial(noise_texture, contrast=28, finest_px=2.0)
    wall = plane(-4.0 * per_step_px, 0.03 * per_step_px, 0.02 * per_step_px)
    return [
        Surface(wall, texture(4, mean=115), everywhere),
        Surface(plane(5.0 * per_step_px), texture(5, mean=140), disc((90.0, 60.0), 34.0)),
    ]


@cache
def exact_cross() -> np.ndarray:
    return render_views(surfaces_of(CROSS_PX), SHAPE, CROSS[0], CROSS[1], supersample=1)


def scene_of(
    exact: np.ndarray, steps: np.ndarray, reference: int, per_step_px: float, noise: float
) -> Scene:
    views = RectifiedViews(expose(exact, noise=noise, seed=6), steps[0], steps[1], reference)
    true_px = true_slope_px(surfaces_of(per_step_px), SHAPE)
    return Scene(views, true_px, (-6.0 * per_step_px, 7.0 * per_step_px))


def glossy_cross(noise: float, highlights: int) -> Scene:
    """17 exactly placed views; `highlights`, if any, is the seed of some gloss on the scene."""
    exact = exact_cross() + (gloss(CROSS, highlights, 9.0 * CROSS_PX) if highlights else 0.0)
    return scene_of(exact, CROSS, 0, CROSS_PX, noise)


def gloss(steps: np.ndarray, seed: int, largest_px: float) -> np.ndarray:
    """Soft highlights, which lie at other slopes than the surface that shines."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)
    light = np.zeros((steps.shape[1], *SHAPE))
    for _ in range(4):
        u, v, size = rng.uniform(0, SHAPE[1]), rng.uniform(0, SHAPE[0]), rng.uniform(15.0, 45.0)
        slope, strength = rng.uniform(-largest_px, largest_px), rng.uniform(40.0, 60.0)
        for lit, x, y in zip(light, *steps, strict=True):
            square = (columns - u + slope * x) ** 2 + (rows - v + slope * y) ** 2
            lit += strength * np.exp(-0.5 * square / size**2)
    return light


@pytest.fixture(scope="module")
def wall() -> Scene:
    steps = np.stack([X_STEPS, Y_STEPS])
    exact = render_views(surfaces_of(1.0), SHAPE, X_STEPS, Y_STEPS, supersample=1)
    return scene_of(exact, steps, REFERENCE, 1.0, noise=1.0)


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


@pytest.mark.parametrize("highlights", [2, 4, 9, 11])
def test_gloss_moves_no_view(highlights: int) -> None:
    """The views are exactly placed; what shines moves over the wall, and the noise is small."""
    scene = glossy_cross(0.5, highlights)
    found = place(scene, scene.views)
    assert not found.misplaced.any()
    assert not found.steps.any()
    assert not found.beside_px.any()


def test_a_part_of_a_picture_that_moved_does_not_move_the_view(wall: Scene) -> None:
    images = wall.views.images.astype(np.float32)
    moved = on_their_lines(images, np.array([[0.0, 0.0]] * 3 + [[0.5, 0.3]] + [[0.0, 0.0]]))
    images[3, :72, :80] = moved[3, :72, :80]
    found = place(wall, replace(wall.views, images=images))
    assert not found.misplaced.any()


def test_sigma_of_a_distance_holds_with_gloss_and_without() -> None:
    shares = [
        found.distance_px[1:] / found.sigma_px[1:]
        for noise, highlights in ((1.0, 0), (0.3, 0), (0.5, 2), (0.5, 4), (0.5, 9), (0.5, 11))
        for scene in (glossy_cross(noise, highlights),)
        for found in (place(scene, scene.views),)
    ]
    each = np.sqrt((np.array(shares) ** 2).mean(axis=1))
    assert 0.7 < float(np.sqrt((each**2).mean())) < 1.4, each
    assert each.max() < 1.8, each


def test_only_the_view_that_was_moved_along_its_baseline_is_corrected(wall: Scene) -> None:
    error = np.zeros((5, 2))
    error[2] = 0.03, 0.0
    told = PLACES - error
    found = place(wall, replace(wall.views, x_steps=told[:, 0], y_steps=told[:, 1]))
    assert found.misplaced.tolist() == [False, False, True, False, False]
    assert found.steps[2] == pytest.approx(error[2], abs=0.005)
    assert not found.steps[[0, 1, 3, 4]].any()


def test_views_of_a_row_are_placed_but_for_what_turns_the_row() -> None:
    exact = render_views(surfaces_of(0.5), SHAPE, ROW[0], ROW[1], supersample=1)
    scene = scene_of(exact, ROW, 2, 0.5, noise=0.5)
    error = np.array([[0.0, 0.0], [0.03, -0.03], [0.0, 0.0], [-0.03, -0.03], [0.0, 0.0]])
    told = ROW.T - error
    found = place(scene, replace(scene.views, x_steps=told[:, 0], y_steps=told[:, 1]))
    assert found.misplaced.tolist() == [False, True, False, True, False]
    assert np.abs(found.steps - error).max() < 0.01


@pytest.mark.slow
def test_sigma_of_slopes_holds_what_no_match_can_know_about_the_places(wall: Scene) -> None:
    """Errors drawn at random have a part in common, which no view shows: sigma must hold it."""
    errors = 0.02 * np.random.default_rng(3).standard_normal((10, 5, 2))
    errors[:, REFERENCE] = 0.0
    of_sigma = []
    for told in PLACES + errors:
        views = replace(wall.views, x_steps=told[:, 0], y_steps=told[:, 1])
        found = estimate_slopes(views, wall.range_px)
        of_sigma.append((found.slope_px - wall.slope_px) / found.sigma_px)
    assert 0.8 < 1.4826 * float(np.nanmedian(np.abs(of_sigma))) < 1.25


def test_right_places_add_nothing_to_sigma(wall: Scene) -> None:
    found = place(wall, wall.views).slope_sigma_px(wall.slope_px.astype(np.float32))
    trusted = estimate_slopes(wall.views, wall.range_px, trust_places=True)
    assert float(np.nanmedian(found / trusted.sigma_px)) < 0.3


def test_an_error_of_all_positions_makes_slopes_uncertain_in_proportion() -> None:
    """In closed form: slopes of a row are wrong by slope * sum(x e) / sum(x^2)."""
    x_steps, sigma_steps, shift_px = np.array([-1.0, 0.0, 1.0, 2.0]), 0.01, 0.05
    rng = np.random.default_rng(1)
    across, slope = rng.normal(0.0, 10.0, 300), rng.uniform(-5.0, 5.0, 300)
    nothing = np.zeros((300, 4))
    lines = Lines(
        nothing, nothing == 0, across, np.zeros(300), slope, half=150, cells=np.arange(0, 300, 10)
    )
    moment = np.diag(np.tile([shift_px**2, shift_px**2, sigma_steps**2, sigma_steps**2], 4))
    variance = slope_variance(lines, lines.tilts(x_steps, np.zeros(4)), moment)
    assert variance == pytest.approx(np.array([shift_px**2, 0.0, sigma_steps**2]) / 6.0)


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
