"""Filled holes: a straight line between their ends, told apart, and never over an answer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from rig.depth.processing.holes import filled
from rig.epipolar import Label, SlopeMap


def slope_map(slope_px: NDArray[np.float32], sigma_px: float = 0.1) -> SlopeMap:
    known = np.isfinite(slope_px)
    sigma = np.where(known, np.float32(sigma_px), np.nan).astype(np.float32)
    return SlopeMap(slope_px, sigma, np.where(known, Label.NEARER, Label.NONE).astype(np.uint8))


def row(*values: float) -> NDArray[np.float32]:
    return np.array([values], np.float32)


HOLE = float("nan")


def test_a_hole_is_bridged_by_a_line_with_what_may_lie_between_in_sigma():
    before = slope_map(row(1.0, HOLE, HOLE, HOLE, 3.0))
    before.sigma_px[0, 4] = 0.5
    found = filled(before, before.label > 0, 3)
    assert found.slope_px[0].tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    assert found.label[0].tolist() == [1, 4, 4, 4, 1]
    for share, sigma_px in zip((0.25, 0.5, 0.75), found.sigma_px[0, 1:4], strict=True):
        ends_px = (1 - share) * 0.1 + share * 0.5
        assert sigma_px == pytest.approx(np.hypot(ends_px, 2.0 / 12**0.5), rel=1e-6)
    assert found.sigma_px[0, [0, 4]].tolist() == before.sigma_px[0, [0, 4]].tolist()


@pytest.mark.parametrize(("largest_px", "is_filled"), [(1, False), (2, True), (3, True)])
def test_holes_up_to_a_length_are_filled(largest_px: int, is_filled: bool):
    before = slope_map(row(1.0, HOLE, HOLE, 1.0))
    found = filled(before, before.label > 0, largest_px)
    assert (found.label[0, 1:3] == Label.FILLED).all() == is_filled
    assert np.isfinite(found.slope_px).all() == is_filled


def test_what_has_one_end_only_is_no_hole():
    before = slope_map(row(HOLE, 1.0, HOLE))
    found = filled(before, before.label > 0, 9)
    assert found.label[0].tolist() == [0, 1, 0]
    assert np.isnan(found.slope_px[0, [0, 2]]).all()


def test_a_hole_is_bridged_the_way_whose_ends_agree_better():
    cross = np.full((3, 3), HOLE, np.float32)
    cross[1, 0], cross[1, 2] = 0.0, 2.0
    cross[0, 1], cross[2, 1] = 5.0, 5.2
    before = slope_map(cross)
    found = filled(before, before.label > 0, 1)
    assert found.slope_px[1, 1] == pytest.approx(5.1)
    assert found.sigma_px[1, 1] == pytest.approx(np.hypot(0.1, 0.2 / 12**0.5))
    turned = slope_map(np.ascontiguousarray(cross.T))
    again = filled(turned, turned.label > 0, 1)
    assert (np.nan_to_num(again.slope_px) == np.nan_to_num(found.slope_px.T)).all()


def test_an_unsure_slope_gives_way_to_a_surer_bridge_only():
    before = slope_map(row(1.0, 7.0, 1.2, 9.0, 1.0))
    before.sigma_px[0, 1], before.sigma_px[0, 3] = 2.0, 0.1
    answered = np.array([[True, False, True, False, True]])
    found = filled(before, answered, 1)
    assert found.slope_px[0].tolist() == pytest.approx([1.0, 1.1, 1.2, 9.0, 1.0])
    assert found.label[0].tolist() == [1, 4, 1, 1, 1]


def test_holes_of_a_plane_are_filled_within_their_sigma():
    rng = np.random.default_rng(3)
    truth = 0.5 + 0.02 * np.arange(80.0) + 0.01 * np.arange(60.0)[:, None]
    measured = (truth + 0.05 * rng.standard_normal(truth.shape)).astype(np.float32)
    measured[rng.random(truth.shape) < 0.3] = np.nan
    before = slope_map(measured, 0.05)
    found = filled(before, before.label > 0, 6)
    was = found.label == Label.FILLED
    error = (found.slope_px - truth)[was] / found.sigma_px[was]
    assert was.mean() > 0.25
    assert 0.5 < 1.4826 * np.median(np.abs(error)) < 1.25
    assert np.mean(np.abs(error) > 3.0) < 0.01


MAPS = arrays(
    np.float32,
    st.tuples(st.integers(1, 9), st.integers(1, 9)),
    elements=st.floats(-9, 9, width=32) | st.just(HOLE),
)


@pytest.mark.slow
@settings(deadline=None)
@given(values=MAPS, largest_px=st.integers(1, 5))
def test_answered_pixels_are_never_touched(values: NDArray[np.float32], largest_px: int):
    before = slope_map(values)
    answered = before.label > 0
    found = filled(before, answered, largest_px)
    for one, other in (
        (found.slope_px, before.slope_px),
        (found.sigma_px, before.sigma_px),
        (found.label, before.label),
    ):
        assert one.dtype == other.dtype
        assert (one[answered] == other[answered]).all()
    was = ~answered & np.isfinite(found.slope_px)
    assert (found.label[~answered] == np.where(was, 4, 0)[~answered]).all()
    assert (np.isfinite(found.sigma_px) == np.isfinite(found.slope_px)).all()
    if was.any():
        assert values[answered].min() - 1e-5 <= found.slope_px[was].min()
        assert found.slope_px[was].max() <= values[answered].max() + 1e-5
        assert found.sigma_px[was].min() >= np.float32(0.1) - 1e-6
