from dataclasses import replace

import numpy as np
import pytest

from rig.epipolar import Label, RectifiedViews, SlopePrior, estimate_slopes
from rig.errors import SlopeError
from tests.unit.epipolar.conftest import Scene


def error_px(scene: Scene, **changes: object) -> np.ndarray:
    slopes = estimate_slopes(replace(scene.views, **changes), scene.range_px)
    return np.abs(slopes.slope_px - scene.slope_px)


def test_a_ball_before_a_tilted_wall_is_measured_to_a_fraction_of_a_pixel(ball: Scene) -> None:
    slopes = estimate_slopes(ball.views, ball.range_px)
    error = np.abs(slopes.slope_px - ball.slope_px)
    assert np.isfinite(slopes.slope_px).mean() > 0.99
    assert np.nanmedian(error) < 0.02
    assert np.nanmean(error > 0.5) < 0.03
    scaled = (slopes.slope_px - ball.slope_px) / slopes.sigma_px
    assert 0.5 < 1.4826 * np.nanmedian(np.abs(scaled)) < 1.6


def test_labels_say_nearer_beyond_and_occluded(ball: Scene) -> None:
    slopes = estimate_slopes(ball.views, ball.range_px)
    label = slopes.label
    assert np.array_equal(np.isnan(slopes.slope_px), label == Label.NONE)
    assert label[46, 66] == Label.NEARER
    assert label[10, 10] == Label.BEYOND
    height, width = ball.slope_px.shape
    rows, columns = np.mgrid[0:height, 0:width]
    away = np.hypot(columns - 66, rows - 46)
    band = (away > 28.5) & (away < 31.0)
    assert (label[band] == Label.OCCLUSION).mean() > 3 * (label == Label.OCCLUSION).mean()


def test_the_same_input_gives_the_same_bits(ball: Scene) -> None:
    one, two = (estimate_slopes(ball.views, ball.range_px) for _ in range(2))
    assert one.slope_px.tobytes() == two.slope_px.tobytes()
    assert one.sigma_px.tobytes() == two.sigma_px.tobytes()
    assert one.label.tobytes() == two.label.tobytes()


@pytest.mark.parametrize("kind", ["uint16", "float32"])
def test_other_grey_scales_give_the_same_slopes(ball: Scene, kind: str) -> None:
    scaled = ball.views.images.astype(np.float64) * (257 if kind == "uint16" else 1 / 255)
    error = error_px(ball, images=scaled.astype(kind))
    assert np.nanmedian(error) < 0.02
    assert np.nanmean(error > 0.5) < 0.03


@pytest.mark.parametrize(
    ("kept", "reference", "bad_share"),
    [([0, 1, 2], 1, 0.08), ([1, 3, 4], 0, 0.08), ([1, 2], 0, 0.15)],
    ids=["row", "column", "pair"],
)
def test_fewer_views_still_answer(
    ball: Scene, kept: list[int], reference: int, bad_share: float
) -> None:
    error = error_px(
        ball,
        images=ball.views.images[kept],
        x_steps=ball.views.x_steps[kept],
        y_steps=ball.views.y_steps[kept],
        reference=reference,
    )
    assert np.nanmean(error > 0.5) < bad_share


def test_a_narrow_prior_is_never_left(ball: Scene) -> None:
    sigma = np.full(ball.slope_px.shape, 0.15, np.float32)
    prior = SlopePrior(np.full(ball.slope_px.shape, 1.0, np.float32), sigma)
    slopes = estimate_slopes(ball.views, ball.range_px, prior)
    known = slopes.label != Label.NONE
    assert np.all(np.abs(slopes.slope_px[known] - 1.0) <= 0.3 + 1e-5)


def test_a_prior_with_holes_is_searched_exhaustively_in_the_holes(ball: Scene) -> None:
    mean = ball.slope_px.astype(np.float32)
    mean[:, 40:90] = np.nan
    prior = SlopePrior(mean, np.full(mean.shape, 0.2, np.float32))
    error = np.abs(estimate_slopes(ball.views, ball.range_px, prior).slope_px - ball.slope_px)
    assert np.nanmedian(error[:, 40:90]) < 0.03
    assert np.nanmax(error[:, :40]) <= 0.4 + 1e-5


def test_views_without_any_texture_give_no_answer() -> None:
    flat = np.full((3, 40, 48), 90, np.uint8)
    views = RectifiedViews(flat, np.array([-1.0, 0.0, 1.0]), np.zeros(3), 1)
    slopes = estimate_slopes(views, (-3.0, 3.0))
    assert np.all(slopes.label == Label.NONE)
    assert np.all(np.isnan(slopes.slope_px))


def test_a_black_view_is_left_out_and_named(ball: Scene) -> None:
    images = ball.views.images.copy()
    images[2] = 0
    slopes = estimate_slopes(replace(ball.views, images=images), ball.range_px)
    assert len(slopes.warnings) == 1
    assert "view 2" in slopes.warnings[0]
    assert np.nanmedian(np.abs(slopes.slope_px - ball.slope_px)) < 0.03


def test_a_view_of_another_scene_is_left_out_and_named(ball: Scene) -> None:
    images = ball.views.images.copy()
    images[2] = images[2, ::-1, ::-1]
    slopes = estimate_slopes(replace(ball.views, images=images), ball.range_px)
    assert len(slopes.warnings) == 1
    assert "view 2" in slopes.warnings[0]
    assert "frozen" in slopes.warnings[0]
    assert np.nanmedian(np.abs(slopes.slope_px - ball.slope_px)) < 0.03


def test_views_of_one_scene_are_never_left_out(ball: Scene) -> None:
    assert estimate_slopes(ball.views, ball.range_px).warnings == ()


def test_saturated_pixels_are_named(ball: Scene) -> None:
    images = np.minimum(ball.views.images, 140)
    slopes = estimate_slopes(replace(ball.views, images=images), ball.range_px)
    assert any("saturated" in warning for warning in slopes.warnings)
    dim = ball.views.images[1] < 130
    assert np.nanmedian(np.abs(slopes.slope_px - ball.slope_px)[dim]) < 0.03


@pytest.mark.parametrize("range_px", [(2.0, 2.0), (3.0, -1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_an_empty_range_is_refused(ball: Scene, range_px: tuple[float, float]) -> None:
    with pytest.raises(SlopeError, match="lower one first"):
        estimate_slopes(ball.views, range_px)


def test_a_prior_of_another_shape_is_refused(ball: Scene) -> None:
    wrong = np.zeros((10, 12), np.float32)
    with pytest.raises(SlopeError, match=r"\(10, 12\)"):
        estimate_slopes(ball.views, ball.range_px, SlopePrior(wrong, wrong + 1))


def test_images_with_nan_are_refused(ball: Scene) -> None:
    images = ball.views.images.astype(np.float32)
    images[0, 3, 4] = np.nan
    with pytest.raises(SlopeError, match="not finite"):
        estimate_slopes(replace(ball.views, images=images), ball.range_px)
