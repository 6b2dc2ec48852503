"""A region of interest: the same slopes for less work, and a camera that fits."""

import numpy as np
import pytest

from rig.depth.processing.region import Region, estimate_around
from rig.epipolar import Label, RectifiedViews, SlopePrior, estimate_slopes
from rig.epipolar.mending.cropped import cropped_field, cropped_rows
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.mending.smooth_field import TERMS, SmoothField
from rig.errors import ConfigError
from tests.support.lightfield import (
    Surface,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

SHAPE = (120, 200)
X = np.array([0.0, -1.0, 0.9, 0.0, 0.0])
Y = np.array([0.0, 0.0, 0.0, -1.1, 1.0])
RANGE_PX = (-4.0, 6.0)
REGION = Region(70, 40, 60, 40)


@pytest.fixture(scope="module")
def surfaces() -> list[Surface]:
    texture = noise_texture(1, mean=120.0, contrast=25.0, finest_px=2.0)
    return [Surface(plane(-1.0, per_u=0.02), texture, everywhere)]


@pytest.fixture(scope="module")
def views(surfaces: list[Surface]) -> RectifiedViews:
    images = expose(render_views(surfaces, SHAPE, X, Y, supersample=2), noise=1.0, seed=1)
    return RectifiedViews(images, X, Y, 0)


def test_the_slopes_of_a_region_are_those_of_the_whole(
    surfaces: list[Surface], views: RectifiedViews
):
    whole = estimate_slopes(views, RANGE_PX)
    found = estimate_around(REGION, views, RANGE_PX, None)
    assert found.slope_px.shape == SHAPE
    assert found.slope_px.dtype == found.sigma_px.dtype == np.float32
    inside = REGION.of(found.slope_px)
    assert np.isfinite(inside).mean() > 0.98
    truth = REGION.of(true_slope_px(surfaces, SHAPE))
    errors = [np.nanmedian(np.abs(part - truth)) for part in (inside, REGION.of(whole.slope_px))]
    assert errors[0] < 1.3 * errors[1] + 1e-3
    prior = SlopePrior(found.slope_px, np.full(SHAPE, 0.2, np.float32))
    followed = estimate_around(REGION, views, RANGE_PX, prior)
    assert np.nanmedian(np.abs(REGION.of(followed.slope_px) - truth)) < 1.3 * errors[1] + 1e-3


def test_only_what_the_region_needs_is_searched(views: RectifiedViews):
    part = REGION.around(views, RANGE_PX)
    # A view at -1.0 shows a slope of 6 px by 6 px further right, one at 0.9 by 5.4 px left.
    assert (part.x_px, part.y_px) == (70 - 6 - 24, 40 - 6 - 24)
    assert part.x_px + part.width_px == 70 + 60 + 6 + 24
    assert part.y_px + part.height_px == 40 + 40 + 7 + 24
    found = estimate_around(REGION, views, RANGE_PX, None)
    outside = np.ones(SHAPE, bool)
    part.of(outside)[...] = False
    assert (found.label[outside] == Label.NONE).all()
    assert np.isnan(found.slope_px[outside]).all()
    assert np.isnan(found.sigma_px[outside]).all()


def test_a_region_at_the_border_needs_nothing_beyond_it(views: RectifiedViews):
    corner = Region(0, 100, 20, 20).around(views, RANGE_PX)
    assert (corner.x_px, corner.y_px) == (0, 100 - 30)
    assert corner.y_px + corner.height_px == SHAPE[0]
    assert Region(0, 0, 200, 120).around(views, RANGE_PX) == Region(0, 0, 200, 120)


@pytest.mark.parametrize("region", [Region(141, 0, 60, 40), Region(0, 81, 60, 40)])
def test_a_region_that_leaves_the_maps_is_refused_with_both_sizes_told(
    views: RectifiedViews, region: Region
):
    told = rf"60 x 40 px at \({region.x_px}, {region.y_px}\) asked for, the maps are of 200 x 120"
    with pytest.raises(ConfigError, match=told):
        estimate_around(region, views, RANGE_PX, None)
    Region(140, 80, 60, 40).require_inside(SHAPE)


def field(seed: int) -> SmoothField:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((TERMS, TERMS))
    return SmoothField(rng.standard_normal(TERMS), (400, 640), root @ root.T, 0.1)


def test_a_field_of_a_part_has_the_values_of_the_whole():
    whole = field(1)
    part = cropped_field(whole, 120, 90, (200, 300))
    x, y = np.random.default_rng(2).uniform(0, (299, 199), (50, 2)).T
    assert part.at(x, y) == pytest.approx(whole.at(x + 120, y + 90), abs=1e-9)
    assert part.sigma_at(x, y) == pytest.approx(whole.sigma_at(x + 120, y + 90), rel=1e-6)
    assert part.shape == (200, 300)
    assert part.scatter == whole.scatter


def test_rows_of_a_part_mend_as_those_of_the_whole():
    fields = (None, field(3))
    across, none = np.array([[0.0, 0.0], [0.0, 1.0]]), np.zeros(2)
    rows = RowErrors(fields, across, np.array([0.0, 0.4]), ("", "0.4 px low"), none)
    part = cropped_rows(rows, 10, 20, (100, 150))
    assert part.fields[0] is None
    assert part.fields[1] is not None
    assert part.fields[1].everywhere() == pytest.approx(
        field(3).everywhere()[20:120, 10:160], abs=1e-4
    )
    assert part.worst == rows.worst
    assert (part.rms_px == rows.rms_px).all()
