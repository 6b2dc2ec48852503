"""The board and the window that shows it, by their numbers."""

import numpy as np
import pytest
from rig_sim.board import INK, PAPER, Board
from rig_sim.optics import TrueCamera
from rig_sim.window import Window

BOARD = Board(
    columns=2,
    rows=1,
    square_mm=10.0,
    margin_mm=4.0,
    centre_mm=(7.0, -5.0, 400.0),
    rotation_deg=(0.0, 0.0, 90.0),
)
CAMERA = TrueCamera(
    view="it",
    width_px=80,
    height_px=60,
    focal_px=100.0,
    centre_px=(39.5, 29.5),
    position_mm=(0.0, 0.0, 0.0),
    rotation_deg=(0.0, 0.0, 0.0),
    distortion=(0.0, 0.0, 0.0, 0.0, 0.0),
)


def flat(x_mm: float, y_mm: float) -> Board:
    """Three by two squares of 10 mm and a margin of 5 mm, 100 mm away: a millimetre is a pixel."""
    return Board(
        columns=2,
        rows=1,
        square_mm=10.0,
        margin_mm=5.0,
        centre_mm=(x_mm, y_mm, 100.0),
        rotation_deg=(0.0, 0.0, 0.0),
    )


def test_a_board_has_a_square_more_than_corners_and_a_margin_on_every_side():
    assert BOARD.squares_across == (3, 2)
    assert BOARD.half_size_mm.tolist() == [19.0, 14.0]


def test_corners_lie_a_square_apart_around_the_middle_row_by_row():
    assert BOARD.corners_mm().tolist() == [[-5.0, 0.0], [5.0, 0.0]]
    larger = Board(3, 2, 4.0, 0.0, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    assert larger.corners_mm().tolist() == [
        [-4.0, -2.0], [0.0, -2.0], [4.0, -2.0], [-4.0, 2.0], [0.0, 2.0], [4.0, 2.0],
    ]  # fmt: skip


def test_a_plain_board_begins_with_a_black_square():
    light = np.array([[INK, PAPER, INK], [PAPER, INK, PAPER]], np.float32)
    np.testing.assert_array_equal(BOARD.texels, light)
    assert BOARD.texel_mm == 10.0


def test_a_print_has_several_texels_to_a_square():
    printed = Board(2, 1, 10.0, 4.0, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("#.#.##",) * 4)
    assert printed.texels.shape == (4, 6)
    assert printed.texel_mm == 5.0
    assert not printed.texels.flags.writeable


def test_a_quarter_turn_carries_the_right_side_of_the_board_down():
    points_mm = BOARD.in_world_mm(np.array([[3.0, 0.0], [0.0, 2.0]]))
    assert points_mm == pytest.approx(np.array([[7.0, -2.0, 400.0], [5.0, -5.0, 400.0]]))


def test_its_shape_reaches_to_the_end_of_the_margin():
    matrix = BOARD.shape().world_from_unit
    expected = [
        [0.0, -14.0, 0.0, 7.0],
        [19.0, 0.0, 0.0, -5.0],
        [0.0, 0.0, 1.0, 400.0],
        [0, 0, 0, 1],
    ]
    assert matrix == pytest.approx(np.array(expected), abs=1e-12)


def test_its_outline_goes_once_around_in_even_steps():
    assert BOARD.outline_mm(2).tolist() == [
        [-19.0, -14.0], [0.0, -14.0], [19.0, -14.0], [19.0, 0.0],
        [19.0, 14.0], [0.0, 14.0], [-19.0, 14.0], [-19.0, 0.0],
    ]  # fmt: skip


def test_the_window_of_a_board_has_two_more_pixels_on_every_side():
    # Half a board is 20 x 15 mm: columns 19.5 to 59.5, rows 14.5 to 44.5.
    window = Window.of_board(CAMERA, flat(0.0, 0.0))
    assert window == Window(17, 12, 63, 48)
    assert (window.width, window.height) == (46, 36)
    assert window.pixels == (slice(12, 48), slice(17, 63))
    assert not window.is_empty


def test_a_window_ends_where_the_picture_ends():
    assert Window.of_board(CAMERA, flat(30.0, -25.0)) == Window(47, 0, 80, 23)
    assert Window.whole(CAMERA) == Window(0, 0, 80, 60)


@pytest.mark.parametrize(
    ("x_mm", "y_mm", "is_empty"),
    [(62.0, 0.0, False), (63.0, 0.0, True), (0.0, 47.0, False), (0.0, 48.0, True), (99, 99, True)],
)
def test_a_window_without_a_column_or_a_row_is_empty(x_mm: float, y_mm: float, is_empty: bool):
    assert Window.of_board(CAMERA, flat(x_mm, y_mm)).is_empty == is_empty
