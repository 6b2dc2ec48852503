"""Cameras of another tool's file as the views of a profile."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import FormatError
from rig.export.geometry_import import into_one_view, match_views
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


def test_cameras_that_no_view_takes_are_left_out_on_demand() -> None:
    there = geometry_of((*(f"cam{number}" for number in range(5)), "spare"), 5)
    view_of = {f"cam{number}": name for number, name in enumerate(NAMES)}
    found = match_views(there, PROFILE, view_of)
    assert found.names == NAMES
    assert [camera.fx_px for camera in found.cameras] == [900.0, 901.0, 902.0, 903.0, 904.0]
    at_mm = [pose.translation_mm[0] for pose in found.cam_from_reference]
    assert at_mm == pytest.approx([10.0 * (n - PROFILE.reference) for n in range(5)])


def test_one_camera_takes_the_place_of_one_view() -> None:
    before = geometry_of(NAMES, PROFILE.reference)
    before = replace(before, covariance=np.eye(before.parameter_count))
    camera = CameraModel(640, 480, 800.0, 801.0, 320.0, 240.0, "brown5", (0.1, 0, 0, 0, 0))
    alone = RigGeometry(("ost",), 0, (camera,), (Pose.identity(),))
    found = into_one_view(alone, PROFILE, {"ost": NAMES[2]}, before)
    assert found.cameras == (*before.cameras[:2], camera, *before.cameras[3:])
    assert found.cam_from_reference == before.cam_from_reference
    assert found.covariance is None
    named = replace(alone, names=(NAMES[4],))
    assert into_one_view(named, PROFILE, None, before).cameras[4] == camera


@pytest.mark.parametrize(
    ("named", "width_px", "is_known", "says"),
    [
        ("ost", 640, True, "one camera, ost; the views of sim are"),
        (NAMES[0], 640, False, "of the other views of sim nothing is known"),
        (NAMES[0], 641, True, "pictures of 641 x 480 px, view centre is calibrated at 640 x 480"),
    ],
)
def test_one_camera_that_cannot_be_a_view_is_told_with_why(
    named: str, width_px: int, is_known: bool, says: str
) -> None:
    camera = CameraModel(width_px, 480, 800.0, 801.0, 320.0, 240.0)
    alone = RigGeometry((named,), 0, (camera,), (Pose.identity(),))
    others = geometry_of(NAMES, PROFILE.reference) if is_known else None
    with pytest.raises(FormatError, match=says):
        into_one_view(alone, PROFILE, None, others)
