"""A view that shows the picture of the reference is named, views alike by right are not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from rig.epipolar import RectifiedViews, estimate_slopes
from rig.epipolar.mending.usable import seen_views
from tests.support.lightfield import (
    Field,
    Surface,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
)
from tests.unit.epipolar.conftest import SHAPE, X_STEPS, Y_STEPS, Scene, texture

REFERENCE = 1


def with_picture(views: RectifiedViews, view: int, picture: np.ndarray) -> RectifiedViews:
    images = views.images.copy()
    images[view] = picture
    return replace(views, images=images)


def wall(slope_px: Field, grey: Field, noise: float, x_steps: np.ndarray = X_STEPS) -> np.ndarray:
    surfaces = [Surface(slope_px, grey, everywhere)]
    exact = render_views(surfaces, SHAPE, x_steps, Y_STEPS, supersample=1)
    return expose(exact, noise=noise, seed=2)


def doubled(views: RectifiedViews) -> list[str]:
    return [text for text in seen_views(views)[1] if "same picture" in text]


def compressed(picture: np.ndarray) -> np.ndarray:
    _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])
    decoded = cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE)
    assert decoded is not None
    return decoded


@pytest.mark.parametrize("kind", ["copy", "compressed", "darker", "taken again"])
def test_a_view_that_shows_the_picture_of_the_reference_is_left_out_by_name(
    ball: Scene, kind: str
) -> None:
    picture = ball.views.images[REFERENCE]
    noise = np.random.default_rng(9).standard_normal(picture.shape)
    once_more = {
        "copy": picture,
        "compressed": compressed(picture),
        "darker": np.rint(0.9 * picture).astype(np.uint8),
        "taken again": np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8),
    }[kind]
    views = with_picture(ball.views, 2, once_more)
    kept, warnings = seen_views(views)
    assert len(kept.images) == 4
    (text,) = warnings
    assert text.startswith("view 2 at (0.97, 0) shows the same picture as the reference")
    assert text.endswith("it was left out")


def test_a_copy_of_the_reference_moves_no_other_view(ball: Scene) -> None:
    views = with_picture(ball.views, 2, ball.views.images[REFERENCE])
    found = estimate_slopes(views, ball.range_px)
    assert found.placement is None
    assert [text[:18] for text in found.warnings] == ["view 2 at (0.97, 0"]
    error_px = np.abs(found.slope_px - ball.slope_px)
    assert float(np.nanmedian(error_px)) < 0.05


def test_of_three_views_a_copy_is_told_in_colour_too(ball: Scene) -> None:
    colour = np.repeat(ball.views.images[:3, :, :, None], 3, axis=3).astype(np.uint8)
    views = RectifiedViews(colour, X_STEPS[:3], Y_STEPS[:3], REFERENCE)
    assert doubled(views) == []
    assert len(doubled(with_picture(views, 2, colour[REFERENCE]))) == 1


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("slope_px", [0.0, 0.02, 3.0])
@pytest.mark.parametrize("grey", ["texture", "flat", "stripes"])
def test_views_that_are_alike_by_right_are_kept(noise: float, slope_px: float, grey: str) -> None:
    painted = {
        "texture": texture(1, 110.0),
        "flat": lambda u, v: np.full(np.broadcast(u, v).shape, 110.0),
        "stripes": lambda u, v: 110.0 + 40.0 * np.sin(v / 2.0) + 0.0 * u,
    }[grey]
    images = wall(plane(slope_px), painted, noise)
    assert doubled(RectifiedViews(images, X_STEPS, Y_STEPS, REFERENCE)) == []


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_view_close_to_the_reference_is_kept(noise: float) -> None:
    x_steps = np.array([-1.0, 0.0, 0.01, 4.0, 0.0])
    grey = noise_texture(3, mean=110.0, contrast=25.0, finest_px=2.0)
    images = wall(plane(5.0), grey, noise, x_steps)
    assert doubled(RectifiedViews(images, x_steps, Y_STEPS, REFERENCE)) == []


def test_a_pair_is_told_nothing(ball: Scene) -> None:
    picture = ball.views.images[REFERENCE]
    pair = RectifiedViews(np.stack([picture, picture]), np.array([-1.0, 0.0]), np.zeros(2), 1)
    assert doubled(pair) == []
