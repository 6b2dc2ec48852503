"""Bits in the squares of a lattice, and where a lattice lies on a board, number by number."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets import CharucoBoard
from rig.targets.charuco import cells, markers
from rig.targets.charuco.cells import ReadCells, SampledCells, flat_grid, padded_grid, sample_cells
from rig.targets.charuco.markers import Placing, known_markers, place_on_board

BOARD = CharucoBoard(7, 5, 25.0, 18.75, "4X4_50")


def grid(rows: int, columns: int, side_px: float, at: tuple[float, float] = (0.0, 0.0)) -> Float:
    row, column = np.mgrid[:rows, :columns].astype(np.float64)
    return side_px * np.stack([column, row], axis=-1) + np.array(at)


def under(homography: Float, places: Float) -> Float:
    mapped = np.concatenate([places, np.ones((*places.shape[:-1], 1))], axis=-1) @ homography.T
    return mapped[..., :2] / mapped[..., 2:]


TILTED = np.array([[20.0, 3.0, 40.0], [-2.0, 22.0, 35.0], [0.01, -0.006, 1.0]])


def test_a_square_goes_to_its_four_corners() -> None:
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.3, 0.8]])
    flat, slanted = under(np.diag([5.0, 4.0, 1.0]), unit), under(TILTED, unit)
    found = cells._homographies(np.stack([flat[:4], slanted[:4]]))
    assert under(found[0], unit) == pytest.approx(flat, abs=1e-9)
    assert under(found[1], unit) == pytest.approx(slanted, abs=1e-9)
    assert found[1] / TILTED[2, 2] == pytest.approx(TILTED, abs=1e-9)


def test_a_ring_of_corners_is_added_around() -> None:
    whole = under(TILTED, grid(6, 7, 1.0) - 1.0)
    seen = whole[1:-1, 1:-1].copy()
    seen[1, 2] = np.nan
    assert flat_grid(seen) == pytest.approx(whole, abs=1e-4)
    assert padded_grid(seen) == pytest.approx(whole, abs=1e-4)


def test_what_the_homography_misses_is_carried_to_the_ring() -> None:
    """Corners bent by a lens: the grid goes through them, the ring follows its neighbours."""
    bent = grid(4, 5, 20.0)
    bent[..., 0] += 0.002 * (bent[..., 0] - 40.0) ** 2
    bent[2, 3] = np.nan
    flat, padded = flat_grid(bent), padded_grid(bent)
    found = np.isfinite(bent[..., 0])
    assert padded[1:-1, 1:-1][found] == pytest.approx(bent[found], abs=1e-12)
    assert padded[3, 4] == pytest.approx(flat[3, 4])
    assert padded[0, 2] - flat[0, 2] == pytest.approx(bent[0, 1] - flat[1, 2], abs=1e-12)
    assert padded[0, 0] - flat[0, 0] == pytest.approx(bent[0, 0] - flat[1, 1], abs=1e-12)
    assert padded[4, -1] - flat[4, -1] == pytest.approx(bent[3, 4] - flat[4, 5], abs=1e-12)
    assert np.abs(padded - flat).max() > 0.1


def test_bits_are_sampled_about_their_middles() -> None:
    """On a picture that is linear every bit is what its middle is."""
    y, x = np.mgrid[:100, :140].astype(np.float32)
    found = sample_cells(2 * x + 3 * y, grid(2, 3, 30.0, (40.0, 35.0)), bits_across=6, share=0.75)
    assert found.shape == (3, 4)
    assert found.levels.shape == (12, 6, 6)
    assert found.inside.tolist() == [True] * 12
    bit = 30 * 0.75 / 6
    middles = (np.arange(6) - 2.5) * bit
    for square in range(12):
        x0, y0 = 40 + 30 * (square % 4 - 0.5), 35 + 30 * (square // 4 - 0.5)
        expected = 2 * (x0 + middles) + 3 * (y0 + middles[:, None])
        assert found.levels[square] == pytest.approx(expected, abs=1e-6)
        assert found.margin[square] == pytest.approx(2 * x0 + 3 * y0, abs=1e-6)


def test_the_margin_is_looked_at_halfway_and_bits_around_their_middle() -> None:
    """Grey is the distance from the middle of a square, along the farther axis."""
    y, x = np.mgrid[:401, :401].astype(np.float32)
    picture = np.maximum(np.abs(x - 200), np.abs(y - 200))
    found = sample_cells(picture, grid(2, 2, 200.0, (100.0, 100.0)), bits_across=5, share=0.75)
    middle = found.levels[4]
    assert found.margin[4] == pytest.approx(200 * (0.5 - 0.25 / 4), abs=1e-4)
    # Places in a bit lie a fifth of it from its middle: 6 px of 30.
    assert middle[2, 2] == pytest.approx(6.0, abs=0.01)
    assert middle[2, 4] == pytest.approx(60.0, abs=0.01)
    assert middle[1, 1] == pytest.approx((24 + 36 + 36 + 36) / 4, abs=0.01)


def test_squares_beyond_the_picture_are_not_inside() -> None:
    y, x = np.mgrid[:70, :90].astype(np.float32)
    found = sample_cells(x + y, grid(2, 3, 20.0, (10.0, 25.0)), bits_across=6, share=0.75)
    assert found.inside.reshape(3, 4).tolist() == [[False, True, True, True]] * 3
    low = sample_cells(x + y, grid(2, 3, 20.0, (25.0, 25.0)), bits_across=6, share=0.75)
    assert low.inside.reshape(3, 4).all()
    down = sample_cells(x + y, grid(2, 3, 20.0, (25.0, 33.0)), bits_across=6, share=0.75)
    assert down.inside.reshape(3, 4).tolist() == [[True] * 4] * 2 + [[False] * 4]


def sampled(levels: Float, margin: list[float], inside: list[bool] | None = None) -> SampledCells:
    count = len(margin)
    return SampledCells(
        (1, count), levels, np.array(margin), np.array(inside or [True] * count, np.bool_)
    )


def marker(bits: list[list[int]], *, black: float = 40.0, white: float = 200.0) -> Float:
    side = len(bits) + 2
    levels = np.full((side, side), black)
    levels[1:-1, 1:-1] = np.where(np.array(bits) > 0, white, black)
    return levels


def test_bits_are_white_above_the_middle_of_margin_and_border() -> None:
    levels = marker([[1, 0], [0, 1]])
    levels[1, 1], levels[1, 2], levels[2, 1] = 121.0, 119.0, 120.0
    read = sampled(levels[None], [200.0]).read()
    assert read.readable.tolist() == [True]
    assert read.bits[0].tolist() == [[True, False], [False, True]]
    turned = sampled(255 - levels[None], [55.0]).read(inverted=True)
    assert turned.readable.tolist() == [True]
    assert turned.bits[0].tolist() == [[True, False], [False, True]]
    assert sampled(255 - levels[None], [55.0]).read().readable.tolist() == [False]


@pytest.mark.parametrize(("white", "is_readable"), [(2, True), (3, False)])
def test_four_of_five_bits_of_the_border_are_black(white: int, is_readable: bool) -> None:
    levels = marker([[1, 0], [0, 1]])  # 12 bits of border: 9.6 must be black
    levels[0, :white] = 200.0
    assert sampled(levels[None], [200.0]).read().readable.tolist() == [is_readable]


def test_weak_squares_and_those_out_of_view_are_not_read() -> None:
    bits = [[1, 0], [0, 1]]
    levels = np.stack([marker(bits), marker(bits), marker(bits), marker(bits)])
    margin = [200.0, 40.0 + 41.0, 40.0 + 39.0, 200.0]
    read = sampled(levels, margin, [True, True, True, False]).read()
    assert read.readable.tolist() == [True, True, False, False]
    assert read.shape == (1, 4)
    assert sampled(np.full((1, 4, 4), 40.0), [40.0]).read().readable.tolist() == [False]
    assert sampled(np.empty((0, 4, 4)), []).read().readable.shape == (0,)


def whole_board(board: CharucoBoard = BOARD) -> ReadCells:
    numbers = board.marker_numbers
    side = board.bits_across - 2
    bits = np.zeros((numbers.size, side, side), np.bool_)
    readable = (numbers >= 0).ravel()
    bits[readable] = board.marker_bits[numbers.ravel()[readable]]
    return ReadCells((numbers.shape[0], numbers.shape[1]), readable, bits)


def turned(read: ReadCells, quarters: int) -> ReadCells:
    """The same squares seen on a lattice turned by quarters."""
    order = np.rot90(np.arange(len(read.readable)).reshape(read.shape), quarters)
    bits = np.rot90(read.bits[order.ravel()], quarters, axes=(1, 2))
    return ReadCells((order.shape[0], order.shape[1]), read.readable[order.ravel()], bits)


def part(read: ReadCells, rows: slice, columns: slice) -> ReadCells:
    order = np.arange(len(read.readable)).reshape(read.shape)[rows, columns]
    return ReadCells(
        (order.shape[0], order.shape[1]), read.readable[order.ravel()], read.bits[order.ravel()]
    )


def place(read: ReadCells) -> Placing | None:
    return place_on_board(read, BOARD.marker_numbers, BOARD.marker_bits)


@pytest.mark.parametrize("quarters", range(4))
def test_a_whole_board_is_placed_in_every_turn(quarters: int) -> None:
    assert place(turned(whole_board(), quarters)) == Placing((4 - quarters) % 4, 0, 0, 17)


@pytest.mark.parametrize("quarters", range(4))
def test_a_part_of_a_board_is_placed_where_it_is(quarters: int) -> None:
    some = turned(part(whole_board(), slice(1, 4), slice(2, 6)), quarters)
    assert place(some) == Placing((4 - quarters) % 4, 1, 2, 6)


def changed(read: ReadCells, square: int, bits: int) -> ReadCells:
    """The first bits of a square turned round."""
    wrong = read.bits.copy()
    flat = wrong[square].ravel()
    flat[:bits] = ~flat[:bits]
    wrong[square] = flat.reshape(wrong[square].shape)
    return ReadCells(read.shape, read.readable, wrong)


def only(read: ReadCells, *squares: int) -> ReadCells:
    readable = np.zeros_like(read.readable)
    readable[list(squares)] = True
    return ReadCells(read.shape, readable, read.bits)


def test_two_bits_of_sixteen_may_be_wrong_beside_another_marker() -> None:
    whole = whole_board()
    assert place(only(changed(whole, 1, 2), 1, 3)) == Placing(0, 0, 0, 2)
    assert place(only(changed(whole, 1, 3), 1, 3)) is None
    assert place(only(whole, 1)) == Placing(0, 0, 0, 1)
    assert place(only(changed(whole, 1, 1), 1)) is None
    assert place(only(whole)) is None


def test_six_of_ten_of_those_that_should_be_there_agree() -> None:
    """Squares 1, 3, 5, 7 and 9 hold markers 0 to 4."""
    whole = whole_board()
    squares = (1, 3, 5, 7, 9)
    assert [int(BOARD.marker_numbers.ravel()[s]) for s in squares] == [0, 1, 2, 3, 4]
    two_wrong = changed(changed(whole, 1, 8), 3, 8)
    assert place(only(two_wrong, *squares)) == Placing(0, 0, 0, 3)
    assert place(only(changed(two_wrong, 5, 8), *squares)) is None


def test_one_of_thirty_may_be_elsewhere() -> None:
    numbers = BOARD.marker_numbers
    at = np.array([[0, 1], [4, 6], [-1, 1], [0, 7], [5, 0], [-9, 3]])
    wanted = [numbers[0, 1], numbers[4, 6], -1, -1, -1, -1]
    assert markers._numbers_at(numbers, at).tolist() == wanted
    whole = whole_board()
    swapped = whole.bits.copy()
    swapped[1] = BOARD.marker_bits[9]
    assert place(ReadCells(whole.shape, whole.readable, swapped)) is None
    large = CharucoBoard(11, 7, 25.0, 18.75, "5X5_100")
    many = whole_board(large)
    bits = many.bits.copy()
    bits[1] = large.marker_bits[9]
    found = place_on_board(
        ReadCells(many.shape, many.readable, bits), large.marker_numbers, large.marker_bits
    )
    assert found == Placing(0, 0, 0, large.marker_count - 1)
    bits[3] = large.marker_bits[20]
    assert (
        place_on_board(
            ReadCells(many.shape, many.readable, bits), large.marker_numbers, large.marker_bits
        )
        is None
    )
    # Read with three wrong bits of 25, as many as are allowed, it is one astray as well.
    bits[3].ravel()[:3] ^= True
    worn = ReadCells(many.shape, many.readable, bits)
    assert place_on_board(worn, large.marker_numbers, large.marker_bits) is None
    bits[3].ravel()[3] ^= True
    unknown = place_on_board(worn, large.marker_numbers, large.marker_bits)
    assert unknown == Placing(0, 0, 0, large.marker_count - 2)


def test_two_markers_with_as_many_wrong_bits_as_are_allowed_place_a_board() -> None:
    worn = changed(changed(whole_board(), 1, 2), 3, 2)
    assert place(only(worn, 1, 3)) == Placing(0, 0, 0, 2)


def test_bits_that_differ_are_counted() -> None:
    one: NDArray[np.bool_] = np.array([[1, 1, 0, 0], [1, 1, 1, 1]], np.bool_)
    other: NDArray[np.bool_] = np.array([[1, 1, 0, 0], [1, 0, 1, 0], [0, 0, 0, 0]], np.bool_)
    assert markers._differences(one, other).tolist() == [[0, 2, 2], [2, 2, 4]]


@pytest.mark.parametrize("quarters", range(4))
def test_markers_are_known_by_their_number_when_upright(quarters: int) -> None:
    some = part(whole_board(), slice(0, 3), slice(0, 4))
    found = known_markers(turned(some, quarters), BOARD.marker_bits)
    numbers = BOARD.marker_numbers[:3, :4]
    assert found == {(r, c): numbers[r, c] for r, c in np.argwhere(numbers >= 0).tolist()}
    assert known_markers(only(some), BOARD.marker_bits) == {}
    wrong = changed(some, 1, 1)
    assert (0, 1) not in known_markers(wrong, BOARD.marker_bits)
    assert len(known_markers(wrong, BOARD.marker_bits)) == 5
