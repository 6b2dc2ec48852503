"""A board that fits either way up is taken one way in all views of a picture."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.errors import CalibrationError
from rig.geometry.camera_model import CameraModel
from rig.geometry.half_turn import agree_by_geometry, agree_on_turns
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting
from rig.targets.checkerboard import Checkerboard

BOARD = Checkerboard(8, 6, 25.0)
POINTS = BOARD.points_mm.reshape(-1, 3)
SIZES = [(640, 400)] * 3
NAMES = ("left", "middle", "right")
CAMERA = np.array([[560.0, 0, 320], [0, 560.0, 200], [0, 0, 1]])


def sightings(tilts_deg: NDArray[np.float64]) -> list[Sighting]:
    """Three cameras, turned against each other by 20 degrees, see every pose."""
    found: list[Sighting] = []
    for picture, tilt in enumerate(np.radians(tilts_deg)):
        board = cv2.Rodrigues(tilt)[0]
        places = (POINTS - POINTS.mean(axis=0)) @ board.T + (0.0, 0.0, 600.0)
        for view in range(3):
            turn = cv2.Rodrigues(np.radians([0.0, 5.0 * (view - 1), 20.0 * view]))[0]
            at = places @ turn.T - (60.0 * (view - 1), 0.0, 0.0)
            xy_px = (at / at[:, 2:]) @ CAMERA.T
            ids = np.arange(len(POINTS), dtype=np.intp)
            found.append(Sighting(picture, view, ids, xy_px[:, :2], np.full(len(POINTS), 0.02)))
    return found


def flip(sighting: Sighting) -> Sighting:
    return Sighting(
        sighting.picture,
        sighting.view,
        len(POINTS) - 1 - sighting.ids,
        sighting.xy_px,
        sighting.sigma_px,
    )


def test_turns_are_found_from_what_the_views_have_in_common():
    random = np.random.default_rng(3)
    truth = sightings(random.uniform(-35, 35, (9, 3)))
    turned = random.random(len(truth)) < 0.5
    given = [flip(s) if t else s for s, t in zip(truth, turned, strict=True)]
    agreed = agree_on_turns(given, POINTS, SIZES, NAMES)
    for picture in range(9):
        ways = {
            bool(np.array_equal(found.ids, true.ids))
            for found, true in zip(agreed, truth, strict=True)
            if true.picture == picture
        }
        assert len(ways) == 1
    kept = agree_on_turns(truth, POINTS, SIZES, NAMES)
    assert all(np.array_equal(a.ids, b.ids) for a, b in zip(kept, truth, strict=True))


def test_pictures_that_fit_both_ways_are_refused():
    with pytest.raises(CalibrationError, match="tilt the board"):
        agree_on_turns(sightings(np.tile([12.0, 0.0, 0.0], (6, 1))), POINTS, SIZES, NAMES)


def test_a_known_geometry_tells_the_way_up_from_one_picture():
    camera = CameraModel(640, 400, 560.0, 560.0, 320.0, 200.0)
    places = tuple(
        Pose(turn, np.array([-60.0 * (view - 1), 0.0, 0.0]))
        for view in range(3)
        for turn in [cv2.Rodrigues(np.radians([0.0, 5.0 * (view - 1), 20.0 * view]))[0]]
    )
    from_first = tuple(place @ places[0].inverse() for place in places)
    geometry = RigGeometry(NAMES, 0, (camera,) * 3, from_first)
    truth = sightings(np.array([[20.0, -10.0, 5.0]]))
    for turned in ([], [1], [2], [1, 2]):
        given = [flip(s) if s.view in turned else s for s in truth]
        agreed = agree_by_geometry(given, POINTS, geometry)
        assert [np.array_equal(a.ids, t.ids) for a, t in zip(agreed, truth, strict=True)] == [
            True
        ] * 3
    assert agree_by_geometry([], POINTS, geometry) == ()
