"""What counts as rows that have moved."""

import numpy as np
import pytest

from rig.epipolar.mending.row_drift import RowDrift
from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.mending.smooth_field import TERMS, SmoothField

SHAPE = (120, 160)
STEPS = np.array([0.0, 1.0, 2.0])


def flat(size_px: float, sigma_px: float) -> SmoothField:
    """The same everywhere, known to a sigma at the middle and worse at the border."""
    coefficients, covariance = np.zeros(TERMS), np.zeros((TERMS, TERMS))
    coefficients[0], covariance[0, 0] = size_px, sigma_px**2
    return SmoothField(coefficients, SHAPE, covariance, 0.0)


def rows(*fields: SmoothField | None) -> RowErrors:
    places = [(np.array([80.0]), np.array([60.0]))] * len(fields)
    return RowErrors.of(fields, np.tile([0.0, 1.0], (len(fields), 1)), places)


def drift_px(left_px: float, left_sigma_px: float, before_sigma_px: float | None) -> np.ndarray:
    before = None if before_sigma_px is None else flat(1.0, before_sigma_px)
    expected = rows(None, before, None)
    return RowDrift(expected, rows(None, flat(left_px, left_sigma_px), None), STEPS).sure_px


@pytest.mark.parametrize(
    ("left_px", "left_sigma_px", "before_sigma_px", "has_moved"),
    [
        (0.4, 0.01, 0.01, True),
        (0.4, 0.2, 0.01, False),  # the frames do not know
        (0.4, 0.01, 0.2, False),  # the sweep did not
        (0.4, 0.01, None, True),  # nobody had looked: rows were taken to meet
        (0.14, 0.0, 0.0, False),  # 0.05 px is what patches are off by themselves
    ],
)
def test_rows_have_moved_beyond_what_both_measurements_leave_open(
    left_px: float, left_sigma_px: float, before_sigma_px: float | None, has_moved: bool
):
    found = drift_px(left_px, left_sigma_px, before_sigma_px)
    assert found == pytest.approx([0.0, left_px if has_moved else 0.0, 0.0], abs=1e-6)


def test_views_that_are_left_out_take_their_drift_along():
    left = rows(None, flat(0.4, 0.01), flat(0.6, 0.01))
    both = RowDrift(rows(None, None, None), left, STEPS)
    some = both.kept(np.array([True, False, True]))
    assert some.sure_px == pytest.approx([0.0, 0.6], abs=1e-6)
    assert some.steps.tolist() == [0.0, 2.0]
