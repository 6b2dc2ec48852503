"""Numbers, names and rotations of other tools' files."""

import numpy as np
import pytest

from rig.errors import FormatError
from rig.export import fields
from rig.geometry.pose import Pose

EYE = np.eye(3).tolist()


@pytest.mark.parametrize("value", [1, 640.0, 999_999])
def test_a_picture_size_is_whole_and_not_absurd(value: float) -> None:
    assert fields.size_px(value, "x") == value


@pytest.mark.parametrize("value", [0, -4, 1.5, 1e6, True, None, "4"])
def test_what_is_no_picture_size_is_refused(value: object) -> None:
    with pytest.raises(FormatError, match="x: expected"):
        fields.size_px(value, "x")


def test_numbers_are_counted() -> None:
    assert fields.numbers([1, 2.5], "x", count=2) == [1.0, 2.5]
    assert fields.numbers([], "x") == []
    with pytest.raises(FormatError, match="expected 3 numbers, found 2"):
        fields.numbers([1, 2], "x", count=3)
    with pytest.raises(FormatError, match="expected 2 rows, found 1"):
        fields.matrix([[1, 2]], (2, 2), "x")
    for odd in ("12", [float("nan")], [True], None):
        with pytest.raises(FormatError):
            fields.numbers(odd, "x")


def test_a_field_that_is_missing_is_named_with_the_first_eight_that_are_there() -> None:
    there = dict.fromkeys("abcdefghij", 1)
    with pytest.raises(FormatError, match="has no z") as caught:
        fields.field(there, "z", "x")
    assert caught.value.advice == "its fields are a, b, c, d, e, f, g, h"


def test_a_rounded_rotation_is_made_exact_and_anything_else_is_refused() -> None:
    turned = Pose.from_vectors(np.array([0.1, -0.2, 0.3]), np.zeros(3)).rotation
    assert np.array_equal(fields.pose(turned, [1.0, 2.0, 3.0], "x").translation_mm, [1.0, 2.0, 3.0])
    rounded = fields.pose(turned + 5e-6 * np.eye(3), [0.0] * 3, "x").rotation
    assert rounded @ rounded.T == pytest.approx(np.eye(3), abs=1e-12)
    assert rounded == pytest.approx(turned, abs=1e-5)
    for odd in (turned + 5e-5 * np.eye(3), np.diag([1.0, 1.0, -1.0])):
        with pytest.raises(FormatError, match="is no rotation"):
            fields.pose(odd, [0.0] * 3, "x")
