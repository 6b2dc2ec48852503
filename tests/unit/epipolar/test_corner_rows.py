"""Row errors from corners of a sweep, and as a stored value."""

import numpy as np
import pytest

from rig.epipolar.mending.corner_rows import CornersBeside, rows_of_corners
from rig.epipolar.mending.row_errors import ROW_ERRORS_JSON, RowErrors
from rig.errors import CurveError

SHAPE = (200, 320)
X_STEPS, Y_STEPS = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -0.9])
NAMES = ("centre", "right", "top")
PER_SLOPE = 0.04


def field_px(x_px: np.ndarray, y_px: np.ndarray, size_px: float) -> np.ndarray:
    """Largest at the bottom left, where it is `size_px`."""
    return size_px * (1.0 - x_px / 319.0) * (y_px / 199.0) ** 2


def corners(size_px: float, per_slope: float = 0.0, seed: int = 3) -> CornersBeside:
    rng = np.random.default_rng(seed)
    x_px, y_px = rng.uniform(10.0, 310.0, 1500), rng.uniform(10.0, 190.0, 1500)
    slope_px = np.repeat(np.linspace(-7.0, 12.0, 15), 100) + 0.01 * x_px
    across_px = field_px(x_px, y_px, size_px) + per_slope * slope_px
    return CornersBeside(x_px, y_px, slope_px, across_px + 0.01 * rng.standard_normal(1500))


def rows(size_px: float, per_slope: float = 0.0) -> RowErrors:
    parts = [None, corners(size_px, per_slope), corners(0.0, seed=4)]
    return rows_of_corners(parts, X_STEPS, Y_STEPS, SHAPE)


@pytest.mark.parametrize("per_slope", [0.0, PER_SLOPE])
def test_rows_are_parted_from_a_camera_off_its_place(per_slope: float):
    found = rows(1.2, per_slope)
    field = found.fields[1]
    assert field is not None
    y_px, x_px = np.mgrid[20:180, 20:300].reshape(2, -1).astype(np.float64)
    assert np.abs(field.at(x_px, y_px) - field_px(x_px, y_px, 1.2)).max() < 0.01
    assert found.per_slope == pytest.approx([0.0, per_slope, 0.0], abs=2e-4)


def test_what_misses_is_said_by_name_and_what_meets_is_known_to_meet():
    found = rows(1.2)
    assert found.lines(NAMES) == ("rows: right is 1.0 px low at the bottom left; calibrate",)
    assert found.rms_px[1] > 0.2
    assert (found.rms_px[0], found.rms_px[2]) == (0.0, 0.0)
    assert found.fields[0] is None
    assert found.fields[2] is not None  # known to be nothing, so not taken out
    pictures = np.zeros((3, *SHAPE), np.uint8)
    pictures[:] = np.arange(320) % 251
    assert np.array_equal(found.mended(pictures)[2], pictures[2])
    assert rows(0.0).any is False
    assert rows(0.0).mended(pictures) is pictures


def test_too_few_corners_tell_nothing():
    few = corners(1.2)
    few = CornersBeside(few.x_px[:9], few.y_px[:9], few.slope_px[:9], few.across_px[:9])
    found = rows_of_corners([None, few, None], X_STEPS, Y_STEPS, SHAPE)
    assert found.fields == (None, None, None)
    assert not found.any


def test_what_is_left_joins_what_was_taken_out():
    first, left = rows(1.2), rows(0.5)
    both = first.plus(left)
    x_px, y_px = np.array([40.0, 200.0]), np.array([180.0, 100.0])
    field = both.fields[1]
    assert field is not None
    assert field.at(x_px, y_px) == pytest.approx(field_px(x_px, y_px, 1.7), abs=0.02)
    assert both.lines(NAMES) == ("rows: right is 1.7 px low at the bottom left; calibrate",)
    assert first.plus(rows(0.0)) is first
    assert rows(0.0, PER_SLOPE).plus(left).lines(NAMES) == (
        "rows: right is 0.5 px low at the bottom left; calibrate",
    )
    assert rows(0.0, PER_SLOPE).plus(left).per_slope[1] == pytest.approx(PER_SLOPE, abs=2e-4)


def test_a_stored_value_comes_back_to_the_last_digit():
    found = rows(1.2)
    again = ROW_ERRORS_JSON.from_json(ROW_ERRORS_JSON.to_json(found))
    assert again.worst == found.worst
    assert np.array_equal(again.rms_px, found.rms_px)
    assert np.array_equal(again.across, found.across)
    for one, other in zip(again.fields, found.fields, strict=True):
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            assert np.array_equal(one.coefficients, other.coefficients)
            assert np.array_equal(one.covariance, other.covariance)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"rms_px": ["low", 0.0, 0.0]}, r"rms_px"),
        ({"worst": ["", ""]}, r"2 descriptions"),
        ({"light": 1}, r"light is unknown"),
    ],
)
def test_a_stored_value_that_is_none_is_refused(change: dict[str, object], says: str):
    broken = ROW_ERRORS_JSON.to_json(rows(1.2)) | change
    with pytest.raises(CurveError, match=rf"mending of rows is ill-formed.*{says}"):
        ROW_ERRORS_JSON.from_json(broken)
