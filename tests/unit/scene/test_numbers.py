"""Geometries as rows of numbers."""

import numpy as np
import pytest

from rig.epipolar.scene.numbers import (
    lens_slice,
    numbers_of,
    pose_slice,
    steps_of,
    with_numbers,
)
from tests.support.scene_features import row_of

LENS = (0.1, -0.02, 1e-3, -2e-3, 0.01)


def test_numbers_come_in_the_order_of_the_covariance():
    rig = row_of((0.1, 0.2, 0.3), (1.0, 2.0, 3.0), focal_px=(450.0, 451.0, 452.0))
    numbers = numbers_of(rig)
    assert numbers[:12].tolist() == [
        *(450.0, 450.0, 319.5, 239.5),
        *(451.0, 451.0, 319.5, 239.5),
        *(452.0, 452.0, 319.5, 239.5),
    ]
    assert np.degrees(numbers[12:15]) == pytest.approx([0.1, 0.2, 0.3])
    assert numbers[15:18].tolist() == [-75.0, 0.0, 0.0]
    assert np.degrees(numbers[18:21]) == pytest.approx([1.0, 2.0, 3.0])
    assert numbers[21:].tolist() == [-150.0, 0.0, 0.0]


def test_numbers_make_the_same_geometry_again():
    rig = row_of((0.1, 0.2, 0.3), coefficients=LENS)
    again = with_numbers(rig, numbers_of(rig))
    assert again.cameras == rig.cameras
    assert np.allclose(again.cam_from_reference[1].rotation, rig.cam_from_reference[1].rotation)
    assert again.cam_from_reference[0].translation_mm.tolist() == [0.0, 0.0, 0.0]


def test_other_numbers_make_another_geometry():
    rig = row_of((0.0, 0.0, 0.0), coefficients=LENS)
    numbers = numbers_of(rig)
    numbers[[1, 2, 8, 9, 20]] = 460.0, 300.0, 0.5, 470.0, 1.5
    other = with_numbers(rig, numbers)
    assert other.cameras[0].fy_px == 460.0
    assert other.cameras[0].cx_px == 300.0
    assert other.cameras[0].coefficients == (*LENS[:4], 0.5)
    assert other.cameras[1].fx_px == 470.0
    assert other.cam_from_reference[1].rotation_rad == pytest.approx([0.0, 0.0, 1.5])


def test_slices_are_where_views_are():
    rig = row_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), coefficients=LENS)
    assert [lens_slice(rig, view) for view in range(3)] == [
        slice(0, 9),
        slice(9, 18),
        slice(18, 27),
    ]
    assert [pose_slice(rig, view) for view in range(3)] == [
        slice(27, 27),
        slice(27, 33),
        slice(33, 39),
    ]


def test_every_number_has_a_step():
    rig = row_of((0.0, 0.0, 0.0), coefficients=LENS)
    assert steps_of(rig).tolist() == [*2 * [*4 * [1e-3], *5 * [1e-6]], *3 * [1e-7], *3 * [1e-4]]
