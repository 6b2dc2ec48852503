"""Every view is chained to the reference, or named."""

import numpy as np
import pytest

from rig.errors import CalibrationError
from rig.geometry.bundle.observations import observe
from rig.geometry.bundle.view_graph import shared_pictures, spanning_tree
from rig.geometry.sighting import Sighting

PLANE_MM = np.array([[x, y, 0.0] for y in (0, 1) for x in (0, 1, 2)], np.float64)


def seen(picture: int, *views: int) -> list[Sighting]:
    return [Sighting(picture, v, np.arange(6), np.zeros((6, 2)), np.ones(6)) for v in views]


def test_views_are_chained_through_the_pairs_that_share_most_pictures():
    sightings = [s for p in range(5) for s in seen(p, 0, 1)]
    sightings += [s for p in range(5, 9) for s in seen(p, 1, 2)] + seen(9, 0, 2)
    shared = shared_pictures(observe(sightings, PLANE_MM, 3), 3)
    assert shared.tolist() == [[6, 5, 1], [5, 9, 4], [1, 4, 5]]
    assert spanning_tree(shared, 0, ("a", "b", "c")) == [(0, 1), (1, 2)]
    assert spanning_tree(shared, 2, ("a", "b", "c")) == [(2, 1), (1, 0)]


def test_views_without_a_common_picture_are_named():
    sightings = seen(0, 0, 1) + seen(1, 2, 3)
    with pytest.raises(CalibrationError, match=r"top, low asked for in the frame of centre.*left"):
        spanning_tree(
            shared_pictures(observe(sightings, PLANE_MM, 4), 4), 0, ("centre", "left", "top", "low")
        )
