"""A weakly textured table that runs away, whose gloss makes grey values drift from row to row."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews, SlopePrior, estimate_slopes
from rig.epipolar.drift import coarse_drift, local_drift, variance_of_slopes
from rig.epipolar.mending.first_match import first_match
from rig.epipolar.sampling import pad
from rig.epipolar.scales import measure_scales
from rig.epipolar.search.window import Cameras, window_of
from tests.support.lightfield import (
    Surface,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

_SHAPE, _RANGE_PX = (96, 128), (-2.2, 2.2)
_ALONG = np.array([0.0, -4, -2, 2, 4, 0, 0, 0, 0])
_DOWN = np.array([0.0, 0, 0, 0, 0, -4, -2, 2, 4])
_CAMERAS = Cameras(_ALONG, _DOWN, 0)
_ROW = np.flatnonzero(_DOWN == 0)
_TABLE = [
    Surface(
        plane(-1.5, 0.0, 0.03),
        noise_texture(1, mean=90.0, contrast=6.0, finest_px=2.0),
        everywhere,
    )
]
_SLOPE_PX = true_slope_px(_TABLE, _SHAPE)
_PRIOR = SlopePrior(_SLOPE_PX.astype(np.float32), np.full(_SHAPE, 0.1, np.float32))


@cache
def _frames(drift_per_step: float) -> NDArray[np.uint8]:
    """Views whose light grows with their row, most in the middle of the table."""
    views = render_views(_TABLE, _SHAPE, _ALONG, _DOWN, supersample=1)
    views += drift_per_step * _DOWN[:, None, None] * _lobe()
    return expose(views, noise=0.7, seed=2)


def _lobe() -> NDArray[np.float64]:
    v, u = np.mgrid[0 : _SHAPE[0], 0 : _SHAPE[1]]
    return np.exp(-0.5 * (((u - 64) / 50) ** 2 + ((v - 48) / 40) ** 2))


def _wrong(frames: NDArray[np.uint8], kept: NDArray[np.intp], prior: SlopePrior | None) -> float:
    """Share of the pixels that miss by more than 0.07 px."""
    views = RectifiedViews(frames[kept], _ALONG[kept], _DOWN[kept], 0)
    found = estimate_slopes(views, _RANGE_PX, prior).slope_px
    return float(np.mean(~(np.abs(found - _SLOPE_PX) <= 0.07)[8:-8, 8:-8]))


def _coarse(images: NDArray[np.float32], prior: SlopePrior | None) -> NDArray[np.float32] | None:
    window = window_of(_SHAPE, _RANGE_PX, prior)
    return coarse_drift(images, _CAMERAS, window, first_match(images, _CAMERAS, window))


def test_light_that_drifts_down_the_column_does_not_make_the_cross_worse_than_its_row() -> None:
    row, cross = (_wrong(_frames(1.0), kept, None) for kept in (_ROW, np.arange(len(_DOWN))))
    assert cross < 0.02
    assert cross <= row


def test_a_hypothesis_keeps_what_the_light_does_not_tell() -> None:
    assert _wrong(_frames(1.0), np.arange(len(_DOWN)), _PRIOR) < 0.02


def test_the_drift_is_found_and_only_on_the_axis_that_has_it() -> None:
    images = _frames(1.0).astype(np.float32)
    found = _coarse(images, None)
    assert found is not None
    splines, scales = pad(images, _ALONG, _DOWN), measure_scales(images, 0)
    closer = local_drift(images, splines, _SLOPE_PX.astype(np.float32), found, _CAMERAS, scales)
    assert closer is not None
    for drift, limit in ((found, 0.15), (closer[0], 0.08)):
        assert np.sqrt(np.mean((drift[1] - _lobe()) ** 2)) < limit
        assert np.sqrt(np.mean(drift[0] ** 2)) < 0.05


def test_where_nothing_drifts_nothing_is_found() -> None:
    images = _frames(0.0).astype(np.float32)
    assert _coarse(images, None) is None
    assert _coarse(images, _PRIOR) is None


def test_a_pair_has_no_drift() -> None:
    cameras = Cameras(_ALONG[[0, 3]], _DOWN[[0, 3]], 0)
    images = _frames(1.0)[[0, 3]].astype(np.float32)
    window = window_of(_SHAPE, _RANGE_PX, None)
    assert coarse_drift(images, cameras, window, first_match(images, cameras, window)) is None


def test_an_uncertain_drift_makes_slopes_uncertain_where_texture_does_not_tell_them_apart() -> None:
    variance = np.zeros((2, 40, 60), np.float32)
    variance[1] = 0.04
    v = np.mgrid[0:40, 0:60][0].astype(np.float32)
    ramp, stripes = 5 * v, 10 * np.sin(2 * np.pi * v / 7).astype(np.float32)
    one_way, both_ways = (variance_of_slopes(variance, g, _CAMERAS)[8:-8] for g in (ramp, stripes))
    assert np.allclose(np.sqrt(one_way), 0.2 / 5, rtol=1e-3)
    assert np.sqrt(both_ways).max() < 0.1 * 0.2 / 5


def test_sigma_covers_what_is_unknown_of_the_drift() -> None:
    found = estimate_slopes(RectifiedViews(_frames(1.0), _ALONG, _DOWN, 0), _RANGE_PX)
    ratio = (np.abs(found.slope_px - _SLOPE_PX) / found.sigma_px)[8:-8, 8:-8]
    assert 0.5 < 1.4826 * np.nanmedian(ratio) < 1.3
