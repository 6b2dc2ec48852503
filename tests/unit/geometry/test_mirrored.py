"""A view whose pictures are mirrored is named, whatever board it shows."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from rig.errors import CalibrationError
from rig.geometry import mirrored as mirrors
from rig.geometry.mirrored import refuse_mirrored
from rig.geometry.sighting import Sighting
from rig.targets import CircleGrid
from rig.targets.checkerboard import Checkerboard

SIZES = [(640, 400), (400, 640), (640, 400)]
NAMES = ("left", "middle", "right")
TURNS_DEG = np.random.default_rng(4).uniform(-30.0, 30.0, (8, 3))


def sightings(board: Checkerboard) -> list[Sighting]:
    """Three cameras, the middle one rolled by a quarter turn, see every pose."""
    points_mm = board.points_mm.reshape(-1, 3)
    found: list[Sighting] = []
    for picture, turn_deg in enumerate(TURNS_DEG):
        rotation = cv2.Rodrigues(np.radians(turn_deg))[0]
        places = (points_mm - points_mm.mean(axis=0)) @ rotation.T + (0.0, 0.0, 600.0)
        for view, (width_px, height_px) in enumerate(SIZES):
            rolled = cv2.Rodrigues(np.radians([0.0, 0.0, 90.0 * (view == 1)]))[0]
            at = (places - (60.0 * (view - 1), 0.0, 0.0)) @ rolled.T
            middle = ((width_px - 1) / 2.0, (height_px - 1) / 2.0)
            xy_px = 500.0 * at[:, :2] / at[:, 2:] + middle
            ids = np.arange(len(points_mm), dtype=np.intp)
            found.append(Sighting(picture, view, ids, xy_px, np.full(len(ids), 0.02)))
    return found


def mirrored(sighting: Sighting, board: Checkerboard) -> Sighting:
    """As it is found in a mirrored picture: numbered so that the board is right-handed there."""
    row, column = np.divmod(sighting.ids, board.columns)
    if board.rows % 2 == 0:
        ids = (board.rows - 1 - row) * board.columns + column
    else:
        ids = row * board.columns + board.columns - 1 - column
    width_px = SIZES[sighting.view][0]
    return replace(sighting, ids=ids, xy_px=sighting.xy_px * (-1, 1) + (width_px - 1, 0))


def refuse(found: list[Sighting], board: Checkerboard) -> None:
    refuse_mirrored(
        found,
        board.points_mm.reshape(-1, 3),
        SIZES,
        NAMES,
        has_one_way_up=board.has_one_way_up,
    )


@pytest.mark.parametrize("board", [Checkerboard(9, 6, 25.0), Checkerboard(8, 6, 25.0)])
@pytest.mark.parametrize("odd", [0, 1, 2])
def test_the_view_that_is_mirrored_is_named(board: Checkerboard, odd: int):
    found = [mirrored(s, board) if s.view == odd else s for s in sightings(board)]
    with pytest.raises(CalibrationError, match=rf"^view {NAMES[odd]}: .*mirrored.* in 8 pict"):
        refuse(found, board)


def test_with_two_views_either_may_be_mirrored():
    board = Checkerboard(9, 6, 25.0)
    found = [s for s in sightings(board) if s.view != 1]
    found = [mirrored(s, board) if s.view == 2 else s for s in found]
    with pytest.raises(CalibrationError, match=r"view right: .*\(or those of left are\)"):
        refuse(found, board)


@pytest.mark.slow
def test_what_is_not_mirrored_passes():
    for board in (Checkerboard(9, 6, 25.0), Checkerboard(8, 6, 25.0)):
        assert refuse(sightings(board), board) is None
    one_view = [s for s in sightings(board) if s.view == 0]
    assert refuse(one_view, board) is None


def test_pictures_that_fit_neither_way_are_not_called_mirrored():
    board = Checkerboard(9, 6, 25.0)
    late = [replace(s, picture=(s.picture + (s.view == 2)) % 8) for s in sightings(board)]
    assert refuse(late, board) is None


def test_a_grid_of_shifted_rows_is_its_own_mirror_picture_only_top_to_bottom():
    odd = CircleGrid(3, 5, 10.0, 8.0).points_mm.reshape(-1, 3)
    partner = mirrors._mirrored_points(odd)
    assert partner is not None
    assert partner.tolist() == [12, 13, 14, 9, 10, 11, 6, 7, 8, 3, 4, 5, 0, 1, 2]
    assert mirrors._mirrored_points(CircleGrid(3, 4, 10.0, 8.0).points_mm.reshape(-1, 3)) is None
    checker = Checkerboard(3, 3, 10.0).points_mm.reshape(-1, 3)
    found = mirrors._mirrored_points(checker)
    assert found is not None
    assert found.tolist() == [2, 1, 0, 5, 4, 3, 8, 7, 6]
