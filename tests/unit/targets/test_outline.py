"""Where a board ends, and where a lattice must lie on it, on drawn squares of known places."""

import numpy as np
import pytest

from rig.arrays import Float
from rig.targets.checkerboard import Checkerboard
from rig.targets.lattice import Lattice
from rig.targets.outline import Sides, ended_sides, goes_on
from rig.targets.placing import certain_place
from rig.targets.pyramid import Picture

SIDE_PX, AT_PX = 20, 50
BOARD = Checkerboard(6, 5, 25.0)
NOWHERE: Sides = (False, False, False, False)


def picture(paper_squares: float = 0.5, board: Checkerboard = BOARD) -> Picture:
    """A board whose corner (0, 0) is at (AT_PX, AT_PX), between pixels."""
    y, x = (np.mgrid[:200, :220] + 0.5 - AT_PX) / SIDE_PX
    beyond = np.maximum(np.maximum(-1 - x, x - board.columns), np.maximum(-1 - y, y - board.rows))
    squares = np.where((np.floor(x) + np.floor(y)) % 2 == 0, 40.0, 200.0)
    grey = np.where(beyond < 0, squares, np.where(beyond < paper_squares, 200.0, 110.0))
    return grey.astype(np.float32)


def part(rows: slice = slice(None), columns: slice = slice(None)) -> Lattice:
    row, column = np.mgrid[: BOARD.rows, : BOARD.columns]
    xy_px = np.stack([column, row], axis=-1) * float(SIDE_PX) + AT_PX - 0.5
    # The squares to the lower right of even corners are dark.
    sign = np.where((row + column) % 2 == 0, -1.0, 1.0)[..., None]
    return Lattice(xy_px, sign * np.array([0.0, 1.0])).part((rows, columns))


def test_a_whole_board_ends_on_all_sides_and_does_not_go_on() -> None:
    assert ended_sides(picture(), part()) == (True, True, True, True)
    assert not goes_on(picture(), part())


@pytest.mark.parametrize(
    ("rows", "columns", "ends"),
    [
        (slice(1, None), slice(None), (False, True, True, True)),
        (slice(None), slice(-1), (True, False, True, True)),
        (slice(-1), slice(None), (True, True, False, True)),
        (slice(None), slice(1, None), (True, True, True, False)),
    ],
)
def test_a_side_from_which_corners_are_missing_goes_on(
    rows: slice, columns: slice, ends: Sides
) -> None:
    assert ended_sides(picture(), part(rows, columns)) == ends
    # A row more is nothing but the outer squares and paper; two are squares that turn once more.
    assert goes_on(picture(), part(rows, columns))


@pytest.mark.parametrize(("paper_squares", "ends"), [(0.1, False), (0.2, True)])
def test_an_end_has_white_paper_beyond_it(paper_squares: float, ends: bool) -> None:
    assert all(ended_sides(picture(paper_squares), part())) is ends
    assert any(ended_sides(picture(paper_squares), part())) is ends


@pytest.mark.parametrize(("share", "ends"), [(0.8, False), (0.9, True), (1.1, True), (1.2, False)])
def test_a_white_sheet_ends_squares_elsewhere(share: float, ends: bool) -> None:
    """It lies over a larger board, so many steps from the first corners of the lattice."""
    covered = picture()
    row = AT_PX + SIDE_PX - round(share * SIDE_PX)
    covered[:row] = 200.0
    assert ended_sides(covered, part(slice(1, None)))[0] is ends


def test_an_end_out_of_the_picture_is_not_told() -> None:
    cut = AT_PX - SIDE_PX - 2  # two pixels beyond the outer squares: three are needed
    seen = part()
    moved = Lattice(seen.xy_px - np.array([0.0, cut]), seen.bright)
    assert ended_sides(picture()[cut:], moved) == (False, True, True, True)
    cut -= 2
    moved = Lattice(seen.xy_px - np.array([0.0, cut]), seen.bright)
    assert ended_sides(picture()[cut:], moved) == (True, True, True, True)


@pytest.mark.parametrize("quarter", range(4))
def test_a_part_with_one_end_has_one_place(quarter: int) -> None:
    seen = part(slice(1, 4))
    # Both sides of a part that is as long as the board say nothing about its rows.
    assert certain_place(turned(seen, quarter), BOARD, around((0, 1, 0, 1), quarter)) is None
    for first, sides in ((0, (1, 1, 0, 1)), (2, (0, 1, 1, 1))):
        seen = part(slice(first, first + 3))
        found = certain_place(turned(seen, quarter), BOARD, around(sides, quarter))
        assert found is not None
        assert (found.row, found.column) == (first, 0)
        there = found.on_board(BOARD)
        assert there[first : first + 3].tolist() == seen.xy_px.tolist()
        assert int(np.isnan(there[..., 0]).sum()) == 12


def turned(lattice: Lattice, quarter: int) -> Lattice:
    return Lattice(np.rot90(lattice.xy_px, quarter), np.rot90(lattice.bright, quarter))


def around(sides: tuple[int, int, int, int], quarter: int) -> Sides:
    """The sides of a lattice turned by `turned`."""
    top, right, bottom, left = (bool(sides[(side + quarter) % 4]) for side in range(4))
    return top, right, bottom, left


def test_no_place_is_certain_without_an_end_or_a_full_length() -> None:
    assert certain_place(part(), BOARD, NOWHERE) is None
    assert certain_place(part(), BOARD, (False, True, False, False)) is not None
    corner = part(slice(3), slice(4))
    assert certain_place(corner, BOARD, (True, False, False, True)) is None
    assert certain_place(part(), Checkerboard(5, 4, 25.0), (True, True, True, True)) is None


def begins(found: Lattice, board: Checkerboard) -> Float:
    place = certain_place(found, board, (True, True, True, True))
    assert place is not None
    return place.on_board(board)[0, 0]


def test_a_board_that_looks_the_same_turned_begins_at_the_top_left() -> None:
    """5 x 5 corners look the same after half a turn, 4 x 4 after a quarter."""
    for count, turns in ((5, (0, 2)), (4, (0, 1, 2, 3))):
        board = Checkerboard(count, count, 25.0)
        seen = part(slice(count), slice(count))
        for quarter in turns:
            assert begins(turned(seen, quarter), board).tolist() == [AT_PX - 0.5, AT_PX - 0.5]
