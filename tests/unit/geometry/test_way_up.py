"""A reference view that stands otherwise than the profile has it."""

import numpy as np
import pytest

from rig.geometry.bundle.suspicion import swapped_layout
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.way_up import turned_reference

CAMERA = CameraModel(64, 40, 50.0, 50.0, 31.5, 19.5)
STEPS = np.array([[0.0, 0.0], [-1.0, 0.0], [1.0, 0.5]])


def rolled(reference_deg: float, others_deg: float = 0.0) -> RigGeometry:
    """Three cameras at 40 mm per step; turned about their axes, clockwise as they look."""
    poses = [
        Pose(turn, -turn @ (40.0 * np.array([*step, 0.0])))
        for step, deg in zip(STEPS, (reference_deg, others_deg, others_deg), strict=True)
        for turn in [about_axis(-deg)]
    ]
    from_reference = tuple(pose @ poses[0].inverse() for pose in poses)
    return RigGeometry(("a", "b", "c"), 0, (CAMERA,) * 3, from_reference)


def about_axis(turn_deg: float) -> np.ndarray:
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("reference_deg", "way", "places"),
    [
        (180.0, "upside down", "a (0, 0), b (1, 0), c (-1, -0.5)"),
        (90.0, "on its side", "a (0, 0), b (0, 1), c (0.5, -1)"),
        (-90.0, "on its side", "a (0, 0), b (0, -1), c (-0.5, 1)"),
        (176.0, "upside down", "a (0, 0), b (1, 0), c (-1, -0.5)"),
    ],
)
def test_it_is_told_with_the_places_in_its_picture(
    reference_deg: float, way: str, places: str
) -> None:
    geometry = rolled(reference_deg)
    told = turned_reference(geometry, STEPS)
    assert told is not None
    assert told.startswith(f"the reference view a stands {way}, ")
    assert told.endswith(f"x_steps and y_steps to {places}")
    (reason,) = swapped_layout(geometry, STEPS)
    assert (reason.code, reason.text) == ("turned", told)


@pytest.mark.parametrize("others_deg", [0.0, 90.0, 180.0])
def test_other_views_may_stand_as_they_like(others_deg: float) -> None:
    geometry = rolled(0.0, others_deg)
    assert turned_reference(geometry, STEPS) is None
    assert swapped_layout(geometry, STEPS) == []


def test_a_whole_rig_upside_down_is_not_called_turned() -> None:
    assert turned_reference(rolled(180.0, 180.0), STEPS) is None


def test_views_at_one_place_tell_nothing() -> None:
    geometry = RigGeometry(("a", "b"), 0, (CAMERA,) * 2, (Pose.identity(),) * 2)
    assert turned_reference(geometry, STEPS[:2]) is None


def test_half_of_the_others_is_not_most_of_them() -> None:
    turned = rolled(180.0)
    poses = list(turned.cam_from_reference)
    # The one view stands as the reference does, where it stood before.
    poses[2] = Pose(np.eye(3), poses[2].rotation.T @ poses[2].translation_mm)
    half = RigGeometry(turned.names, 0, turned.cameras, tuple(poses))
    assert half.centres_mm() == pytest.approx(turned.centres_mm())
    assert turned_reference(half, STEPS) is None
