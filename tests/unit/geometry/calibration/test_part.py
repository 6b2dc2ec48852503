"""The parts of the picture that the headline is told of, and pictures that say nothing new."""

from dataclasses import replace

import numpy as np
import pytest

from rig.calibrate.light import brightness_of, lit_part
from rig.errors import CalibrationError
from rig.frames import Frame
from rig.geometry.bundle.depth_error import depth_errors, depth_sigma_mm
from rig.geometry.bundle.observations import observe
from rig.geometry.bundle.part import COLUMNS, ROWS, nodes_px, part_with_boards
from rig.geometry.bundle.repeats import repeated, require_different_places
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

SIZE = (161, 121)
"""Nodes are 10 px apart."""
POINTS_MM = np.array([[x, y, 0.0] for y in range(3) for x in range(3)])


def sighting(picture: int, xy_px: np.ndarray, view: int = 0) -> Sighting:
    return Sighting(picture, view, np.arange(9), xy_px, np.full(9, 0.1))


def square(left_px: float, top_px: float, side_px: float) -> np.ndarray:
    return POINTS_MM[:, :2] * side_px / 2.0 + (left_px, top_px)


def test_boards_cover_the_nodes_inside_them() -> None:
    boards = [sighting(0, square(5, 5, 30)), sighting(1, square(152, 112, 4), 1)]
    observed = observe([*boards, sighting(2, square(101, 51, 8))], POINTS_MM, 2)
    part = part_with_boards(observed, 0, SIZE, np.ones(27, np.bool_))
    wanted = np.zeros((ROWS, COLUMNS), np.bool_)
    wanted[1:4, 1:4] = True
    wanted[5, 10] = True  # a board between the nodes counts for the nearest
    assert (part == wanted).all()
    without = np.arange(27) >= 9
    assert part_with_boards(observed, 0, SIZE, without).sum() == 1


def lopsided() -> RigGeometry:
    """A pair that knows all but the focal length of the second camera, to 1 px."""
    camera = CameraModel(*SIZE, 150.0, 150.0, 80.0, 60.0)
    poses = (Pose.identity(), Pose(np.eye(3), np.array([-4.0, 0.0, 0.0])))
    covariance = np.zeros((14, 14))
    covariance[4, 4] = 1.0
    return RigGeometry(("a", "b"), 0, (camera, camera), poses, covariance)


def test_the_headline_counts_where_boards_were_seen_beside_the_whole_picture() -> None:
    geometry = lopsided()
    pixels = nodes_px(SIZE)
    seen, lit = np.zeros((2, ROWS, COLUMNS), np.bool_)
    seen[6, 8:10], lit[6, 8:13] = True, True
    for error in depth_errors(geometry, seen, lit):
        sigma_mm = depth_sigma_mm(geometry, error.distance_mm, pixels.reshape(-1, 2))
        pct = 200.0 * sigma_mm.reshape(ROWS, COLUMNS) / error.distance_mm
        assert error.seen_pct == pytest.approx(np.sqrt(np.mean(pct[seen] ** 2)))
        assert error.picture_pct == pytest.approx(np.sqrt(np.mean(pct[lit] ** 2)))
        assert error.worst_pct == pytest.approx(pct[lit].max())
        assert error.seen_pct < error.picture_pct < error.worst_pct
    whole = depth_errors(geometry)[0]
    assert whole.seen_pct == whole.picture_pct
    nothing = depth_errors(geometry, np.zeros((ROWS, COLUMNS), np.bool_))[0]
    assert np.isnan(nothing.seen_pct)


def test_brightness_is_the_mean_about_every_node() -> None:
    image = np.zeros((121, 161), np.uint16)
    image[55:65, 75:85] = 1023  # nearer to the node in the middle than to any other
    image[:5, :5] = 341
    found = brightness_of(Frame("a", image, 0.0, 1, bits=10))
    assert found.shape == (ROWS, COLUMNS)
    assert found[6, 8] == pytest.approx(1.0)
    assert found[0, 0] == pytest.approx(1 / 3)
    assert found.sum() == pytest.approx(4 / 3)


def test_black_corners_of_a_circular_picture_do_not_count() -> None:
    y, x = np.mgrid[-6:7, -8:9]
    inside = x**2 + y**2 < 8.5**2
    dim, bright = np.where(inside, 0.05, 0.03), np.where(inside, 0.5, 0.03)
    bright[6, :8] = 0.01
    lit = lit_part([dim.astype(np.float32), bright.astype(np.float32)])
    assert lit is not None
    assert (lit == inside).all()
    full = np.full((ROWS, COLUMNS), 0.3, np.float32)
    full[0, 0] = 0.0  # something dark in one corner is no edge of the lens
    assert lit_part([full]) is None
    assert lit_part([np.zeros((ROWS, COLUMNS), np.float32)]) is None, "nobody switched on the light"


def test_a_board_that_never_moves_is_refused() -> None:
    random = np.random.default_rng(1)
    still = [sighting(n, square(20, 20, 60) + random.normal(0, 0.05, (9, 2))) for n in range(12)]
    with pytest.raises(CalibrationError, match=r"12 pictures show the board at 1 place only"):
        require_different_places(observe(still, POINTS_MM, 1))
    twice = [*still[:11], sighting(11, square(22, 20, 60))]
    with pytest.raises(CalibrationError, match=r"12 pictures show the board at 2 places only"):
        require_different_places(observe(twice, POINTS_MM, 1))
    thrice = [*twice[:10], sighting(10, square(20, 20.5, 60)), twice[11]]
    assert require_different_places(observe(thrice, POINTS_MM, 1)) is None
    assert require_different_places(observe(still[:2], POINTS_MM, 1)) is None


def test_repeated_pictures_are_told() -> None:
    boards = [sighting(n, square(20 + n, 20, 60)) for n in range(4)]
    again = [replace(boards[1], picture=7), replace(boards[1], picture=9)]
    (reason,) = repeated(observe([*boards, *again], POINTS_MM, 1))
    assert reason.code == "repeated"
    assert reason.text.startswith("2 of 6 pictures are earlier ones again (pictures 7, 9):")
    assert repeated(observe(boards, POINTS_MM, 1)) == []
    other_view = observe([*boards, replace(boards[1], picture=7, view=1)], POINTS_MM, 2)
    assert repeated(other_view) == []
