"""Sightings as flat arrays: their order, what is left out, what is refused."""

import numpy as np
import pytest

from rig.errors import CalibrationError, ConfigError
from rig.geometry.bundle.observations import Observations, observe
from rig.geometry.sighting import Sighting
from rig.targets.checkerboard import Checkerboard

POINTS_MM = Checkerboard(4, 3, 10.0).points_mm.reshape(-1, 3)


def sighting(picture: int, view: int, ids: list[int]) -> Sighting:
    """A point stands where its picture, view and number say."""
    xy_px = np.array([[100.0 * picture + 10 * view, float(i)] for i in ids])
    return Sighting(picture, view, np.array(ids), xy_px, np.array([1.0 + i for i in ids]))


def seen() -> Observations:
    """Pictures 3, 5 and 8 in any order."""
    given = [
        sighting(8, 1, [0, 1, 2, 4, 5, 6]),
        sighting(3, 1, [6, 5, 4, 2, 1, 0, 8]),
        sighting(5, 0, [0, 1, 4, 5, 8, 9]),
        sighting(3, 0, [11, 10, 9, 7, 6, 5]),
        sighting(5, 1, [0, 1, 2, 4, 5]),  # too few
    ]
    return observe(given, POINTS_MM, 2)


def test_all_stands_by_picture_view_and_point() -> None:
    found = seen()
    assert found.pictures == (3, 5, 8)
    assert found.start.tolist() == [0, 6, 13, 19, 25]
    assert found.picture.tolist() == [0, 0, 1, 2]
    assert found.view.tolist() == [0, 1, 0, 1]
    assert found.ids.tolist() == [
        *(5, 6, 7, 9, 10, 11), *(0, 1, 2, 4, 5, 6, 8), *(0, 1, 4, 5, 8, 9), *(0, 1, 2, 4, 5, 6),
    ]  # fmt: skip
    assert found.sigma_px.tolist() == [1.0 + i for i in found.ids]
    assert found.xy_px[:, 1].tolist() == found.ids.tolist()
    assert found.xy_px[[0, 6, 13, 19], 0].tolist() == [300.0, 310.0, 500.0, 810.0]
    assert found.sighting_of_point.tolist() == [0] * 6 + [1] * 7 + [2] * 6 + [3] * 6
    assert found.points(1) == slice(6, 13)


def test_some_pictures_are_kept_with_numbers_of_their_own() -> None:
    kept = seen().of_pictures(np.array([True, False, True]))
    assert kept.pictures == (3, 8)
    assert kept.start.tolist() == [0, 6, 13, 19]
    assert kept.picture.tolist() == [0, 0, 1]
    assert kept.view.tolist() == [0, 1, 1]
    assert kept.xy_px[[0, 6, 13], 0].tolist() == [300.0, 310.0, 810.0]
    assert kept.ids.tolist() == [*seen().ids[:13], *seen().ids[19:]]
    assert kept.sigma_px.tolist() == [1.0 + i for i in kept.ids]


def test_points_of_one_row_say_nothing() -> None:
    row = np.array([[10.0 * i, 0.0, 0.0] for i in range(8)])
    one = Sighting(0, 0, np.arange(8), np.zeros((8, 2)), np.ones(8))
    with pytest.raises(CalibrationError, match="1 sightings given, none of at least 6 points"):
        observe([one], row, 1)


@pytest.mark.parametrize(("thin", "is_used"), [(0.049, False), (0.051, True)])
@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 30.0])
def test_two_rows_are_apart_by_a_twentieth_of_their_length(
    thin: float, is_used: bool, turn_deg: float
) -> None:
    """Two rows of four: their spread across over that along is `thin`."""
    along = np.tile(np.arange(4.0) - 1.5, 2)
    across = np.repeat([-1.0, 1.0], 4) * thin * np.std(along)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    points = np.stack([c * along - s * across, s * along + c * across, 0 * along], axis=1)
    one = Sighting(0, 0, np.arange(8), np.zeros((8, 2)), np.ones(8))
    if is_used:
        assert len(observe([one], points, 1).ids) == 8
    else:
        with pytest.raises(CalibrationError, match="in two rows"):
            observe([one], points, 1)


@pytest.mark.parametrize(("view", "ids"), [(2, [0]), (-1, [0]), (0, [12])])
def test_views_and_points_that_do_not_exist_are_named(view: int, ids: list[int]) -> None:
    with pytest.raises(ConfigError, match=r"views are 0\.\.1|points 0\.\.11"):
        observe([sighting(0, view, ids)], POINTS_MM, 2)


def test_the_last_view_and_point_exist_and_nothing_may_be_there_twice() -> None:
    whole = sighting(0, 1, list(range(12)))
    assert observe([whole, sighting(0, 0, [])], POINTS_MM, 2).view.tolist() == [1]
    with pytest.raises(ConfigError, match="picture 0 of view 1 given twice"):
        observe([whole, sighting(1, 1, list(range(12))), whole], POINTS_MM, 2)
