"""Cameras of another tool's file as the views of a profile."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import FormatError
from rig.export.geometry_import import match_views
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.profile.load import load_profile

PROFILE = load_profile("sim")
NAMES = tuple(view.name for view in PROFILE.views)


def geometry_of(names: tuple[str, ...], reference: int = 0) -> RigGeometry:
    cameras = tuple(
        CameraModel(640, 480, 900.0 + number, 900.0, 320.0, 240.0, "none", ())
        for number in range(len(names))
    )
    places_mm = [np.array([10.0 * (number - reference), 0.0, 0.0]) for number in range(len(names))]
    poses = tuple(Pose.from_vectors(np.zeros(3), place_mm) for place_mm in places_mm)
    return RigGeometry(names, reference, cameras, poses)


def test_views_come_in_the_order_of_the_profile_seen_from_its_reference():
    there = tuple(reversed(NAMES))
    found = match_views(geometry_of(there), PROFILE)
    assert found.names == NAMES
    assert found.reference == PROFILE.reference
    assert [camera.fx_px for camera in found.cameras] == [904.0, 903.0, 902.0, 901.0, 900.0]
    at_mm = [pose.translation_mm[0] for pose in found.cam_from_reference]
    middle = 4 - PROFILE.reference
    assert at_mm == pytest.approx([10.0 * (4 - number - middle) for number in range(5)])


def test_cameras_of_other_names_are_called_as_it_is_said():
    there = ("cam0", *NAMES[1:])
    assert match_views(geometry_of(there), PROFILE, {"cam0": NAMES[0]}).names == NAMES


def test_two_views_can_change_their_names():
    there = geometry_of(NAMES, PROFILE.reference)
    swapped = match_views(there, PROFILE, {NAMES[1]: NAMES[2], NAMES[2]: NAMES[1]})
    assert swapped.cameras[1] == there.cameras[2]
    assert swapped.cameras[2] == there.cameras[1]


def test_a_file_that_fits_keeps_its_covariance():
    plain = geometry_of(NAMES, PROFILE.reference)
    covariance = np.eye(plain.parameter_count)
    found = match_views(replace(plain, covariance=covariance), PROFILE)
    assert found.covariance is not None
    assert np.array_equal(found.covariance, covariance)


def test_names_that_are_in_no_file_are_refused():
    with pytest.raises(FormatError, match="--view names cam7, the file's cameras are"):
        match_views(geometry_of(NAMES), PROFILE, {"cam7": NAMES[0]})


def test_cameras_that_are_not_the_views_are_refused_with_an_example():
    there = ("cam0", *NAMES[1:])
    with pytest.raises(FormatError) as caught:
        match_views(geometry_of(there), PROFILE)
    assert "the file's cameras are cam0" in str(caught.value)
    assert f"--view cam0={NAMES[0]}" in str(caught.value)
