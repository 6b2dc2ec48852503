from functools import cache

import numpy as np
import pytest

from rig.compare.baselines import BASELINES, FILLED, OURS, Method
from rig.epipolar import RectifiedViews
from rig.errors import SlopeError
from tests.support.lightfield import Surface, everywhere, expose, noise_texture, plane, render_views

PLACES = ((1.06, 0.0), (-0.93, 0.0), (0.0, 1.08), (0.0, -0.95))
SLOPE_PX = {"near": 2.3, "far": -3.6}
RANGE_PX = (-6.0, 8.0)
SHAPE = (96, 112)


@cache
def a_pair(place: tuple[float, float], where: str) -> RectifiedViews:
    """A textured wall of one slope, seen from the reference and from one place."""
    x, y = np.array([0.0, place[0]]), np.array([0.0, place[1]])
    texture = noise_texture(3, mean=120.0, contrast=35.0, finest_px=2.5)
    wall = Surface(plane(SLOPE_PX[where]), texture, everywhere)
    return RectifiedViews(expose(render_views([wall], SHAPE, x, y, 2), noise=1.0), x, y, 0)


@pytest.mark.parametrize("where", SLOPE_PX)
@pytest.mark.parametrize("place", PLACES, ids=["right", "left", "below", "above"])
@pytest.mark.parametrize("method", BASELINES + FILLED, ids=lambda method: method.name)
def test_the_slope_of_a_wall_is_met_from_every_side(
    method: Method, place: tuple[float, float], where: str
):
    slope_px = method.run(a_pair(place, where), RANGE_PX)
    assert slope_px.shape == SHAPE
    assert slope_px.dtype == np.float32
    miss_px = (slope_px - SLOPE_PX[where]) * max(map(abs, place))
    known = np.isfinite(miss_px)
    assert known.mean() > 0.5
    assert abs(np.median(miss_px[known])) < 0.25  # SGBM leans towards whole disparities
    assert np.mean(np.abs(miss_px[known]) < 1.0) > 0.95  # SAD also answers at the border


def test_ours_answers_in_the_same_terms():
    slope_px = OURS.run(a_pair(PLACES[0], "near"), RANGE_PX)
    assert np.nanmedian(slope_px) == pytest.approx(SLOPE_PX["near"], abs=0.05)


@pytest.mark.parametrize("method", FILLED, ids=lambda method: method.name)
def test_filled_is_full(method: Method):
    bare = next(m for m in BASELINES if m.name == method.name.removesuffix(" filled"))
    views = a_pair(PLACES[0], "near")
    holey, full = bare.run(views, RANGE_PX), method.run(views, RANGE_PX)
    assert np.isnan(holey).any()
    assert np.isfinite(full).all()
    np.testing.assert_array_equal(full[np.isfinite(holey)], holey[np.isfinite(holey)])


@pytest.mark.parametrize("method", BASELINES, ids=lambda method: method.name)
def test_a_search_wider_than_the_image_is_refused(method: Method):
    with pytest.raises(SlopeError, match=r"112 px along its baseline.*narrow slopes\.range_px"):
        method.run(a_pair(PLACES[0], "near"), (-60.0, 60.0))
