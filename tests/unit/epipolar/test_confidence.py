"""What is known, and what only seems so: no answer or a large sigma where views tell nothing."""

import re
from functools import cache, partial

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews, SlopeMap, SlopePrior, estimate_slopes
from rig.epipolar.views import Label
from tests.support.lightfield import (
    Surface,
    box,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

Array = NDArray[np.float64]

SHAPE = (144, 176)
X_STEPS = np.array([0.0, -1.04, 0.97, 0.0, 0.0])
Y_STEPS = np.array([0.0, 0.0, 0.0, -0.98, 1.05])
ROW_OF_NINE = np.arange(-4.0, 5.0)
RANGE_PX = (-6.0, 7.0)
SURE_SHARE = 0.25
"""Who knows less than a quarter of a blind guess has not answered."""

texture = partial(noise_texture, contrast=28.0, finest_px=2.0)
DISC = [
    Surface(plane(-4.0, 0.012, 0.01), texture(4, mean=115.0), everywhere),
    Surface(plane(4.0), texture(5, mean=140.0), disc((100.0, 70.0), 40.0)),
]
TRUE_PX = true_slope_px(DISC, SHAPE)
ROWS, COLUMNS = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]].astype(float)


def blind_px(range_px: tuple[float, float]) -> float:
    return (range_px[1] - range_px[0]) / 12**0.5


def sure(found: SlopeMap, range_px: tuple[float, float]) -> NDArray[np.bool_]:
    """Pixels that claim to know their slope, (H, W)."""
    return (found.label != Label.NONE) & (found.sigma_px < SURE_SHARE * blind_px(range_px))


def cross_of(exact: Array) -> RectifiedViews:
    return RectifiedViews(expose(exact, noise=1.0, seed=6), X_STEPS, Y_STEPS, 0)


def row_of(surface: Surface) -> RectifiedViews:
    nothing = np.zeros_like(ROW_OF_NINE)
    exact = render_views([surface], SHAPE, ROW_OF_NINE, nothing, supersample=1)
    return RectifiedViews(expose(exact, noise=1.0, seed=6), ROW_OF_NINE, nothing, 4)


@cache
def exact_disc() -> Array:
    return render_views(DISC, SHAPE, X_STEPS, Y_STEPS, supersample=1)


def test_a_plain_wall_behind_a_textured_square_gets_no_answer() -> None:
    surfaces = [
        Surface(plane(-3.0), lambda u, v: np.full(np.shape(u + v), 110.0), everywhere),
        Surface(plane(3.0), texture(5, mean=130.0), box(60.0, 45.0, 115.0, 100.0)),
    ]
    exact = render_views(surfaces, SHAPE, X_STEPS, Y_STEPS, supersample=1)
    found = estimate_slopes(cross_of(exact), (-5.0, 5.0))
    away_px = np.maximum(
        np.maximum(60.0 - COLUMNS, COLUMNS - 115.0), np.maximum(45.0 - ROWS, ROWS - 100.0)
    )
    # The edges of the square are texture for the patches of 17 x 17 px around them.
    assert np.mean(found.label[away_px > 8] == Label.NONE) >= 0.9
    square = away_px < -4
    assert np.mean(found.label[square] == Label.NEARER) > 0.9
    assert np.nanmedian(np.abs(found.slope_px - 3.0)[square]) < 0.05


def test_slopes_outside_the_range_are_blind_and_the_range_is_named() -> None:
    range_px = (-6.0, 1.0)
    found = estimate_slopes(cross_of(exact_disc()), range_px)
    outside, inside = TRUE_PX > 1.5, TRUE_PX < 0.5
    assert np.mean(~sure(found, range_px)[outside]) > 0.95
    assert np.mean(found.label[outside] == Label.NONE) > 0.3
    said = [text for text in found.warnings if "slopes.range_px" in text]
    assert len(said) == 1
    share = re.match(r"(\d+) % of the pixels are at the near end", said[0])
    assert share is not None
    assert 2 < int(share[1]) <= round(100 * float(outside.mean()))
    assert np.mean(sure(found, range_px)[inside]) > 0.95


def test_a_range_that_holds_the_scene_is_not_named() -> None:
    found = estimate_slopes(cross_of(exact_disc()), RANGE_PX)
    assert not any("range_px" in text for text in found.warnings)


def test_stripes_along_a_row_of_views_tell_it_hardly_anything() -> None:
    stripes = noise_texture(8, mean=120.0, contrast=30.0, finest_px=2.0)
    surface = Surface(plane(1.0), lambda u, v: stripes(0.0 * u + 3.3, v), everywhere)
    found = estimate_slopes(row_of(surface), (-5.0, 5.0))
    assert np.mean(sure(found, (-5.0, 5.0))) < 0.1


def test_sigma_of_a_slanted_plane_is_neither_too_small_nor_much_too_large() -> None:
    surface = Surface(plane(-5.0, 0.06), texture(4, mean=115.0), everywhere)
    found = estimate_slopes(row_of(surface), (-7.0, 7.0))
    error = (found.slope_px - true_slope_px([surface], SHAPE))[:, 24:-24]
    ratio = 1.4826 * float(np.nanmedian(np.abs(error / found.sigma_px[:, 24:-24])))
    assert 0.3 < ratio < 1.5


def around(slope_px: Array) -> SlopePrior:
    return SlopePrior(slope_px.astype(np.float32), np.full(SHAPE, 0.1, np.float32))


def test_a_misled_hypothesis_is_named_and_nothing_is_sure() -> None:
    found = estimate_slopes(cross_of(exact_disc()), RANGE_PX, around(TRUE_PX + 2.5))
    assert any("contradict the hypothesis" in text for text in found.warnings)
    assert not sure(found, RANGE_PX).any()
    known = found.label != Label.NONE
    assert found.sigma_px[known] == pytest.approx(blind_px(RANGE_PX), rel=1e-5)


def test_a_hypothesis_that_is_about_right_is_believed() -> None:
    found = estimate_slopes(cross_of(exact_disc()), RANGE_PX, around(TRUE_PX + 0.05))
    assert found.warnings == ()
    assert np.mean(sure(found, RANGE_PX)) > 0.95


def contradicted_to(width_px: int) -> RectifiedViews:
    """Left of a column, every view shows another scene."""
    exact = exact_disc().copy()
    for i in range(1, len(exact)):
        other = texture(60 + i, mean=115.0)
        exact[i, :, :width_px] = other(COLUMNS[:, :width_px], ROWS[:, :width_px])
    return cross_of(exact)


@pytest.mark.parametrize("share", [0.2, 0.4])
def test_what_views_contradict_in_a_part_leaves_the_rest_answered(share: float) -> None:
    width_px = round(share * SHAPE[1])
    found = estimate_slopes(contradicted_to(width_px), RANGE_PX)
    is_sure, error = sure(found, RANGE_PX), np.abs(found.slope_px - TRUE_PX)
    assert np.mean(is_sure[:, : width_px - 12]) < 0.05
    rest = np.s_[:, width_px + 16 :]
    assert np.mean(is_sure[rest]) > 0.9
    assert np.nanmedian(error[rest]) < 0.05
    assert np.mean(is_sure[rest] & (error[rest] > 0.5)) < 0.02


def test_a_hypothesis_that_is_wrong_in_a_part_is_right_in_the_rest() -> None:
    width_px = round(0.2 * SHAPE[1])
    wrong = TRUE_PX.copy()
    wrong[:, :width_px] += 2.5
    found = estimate_slopes(cross_of(exact_disc()), RANGE_PX, around(wrong))
    is_sure = sure(found, RANGE_PX)
    assert not any("contradict" in text for text in found.warnings)
    assert np.mean(is_sure[:, : width_px - 12]) < 0.05
    rest = np.s_[:, width_px + 16 :]
    assert np.mean(is_sure[rest]) > 0.9
    assert np.nanmedian(np.abs(found.slope_px - TRUE_PX)[rest]) < 0.03


def test_one_view_that_shows_another_scene_in_a_part_costs_no_answers() -> None:
    exact = exact_disc().copy()
    exact[2, :, :70] = texture(62, mean=115.0)(COLUMNS[:, :70], ROWS[:, :70])
    found = estimate_slopes(cross_of(exact), RANGE_PX)
    is_sure, error = sure(found, RANGE_PX), np.abs(found.slope_px - TRUE_PX)
    assert np.mean(is_sure) > 0.95
    assert np.mean(is_sure & (error > 0.5)) < 0.02
