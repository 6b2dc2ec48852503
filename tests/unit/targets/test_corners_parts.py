"""The board's order, its smoothness and the level that suits its blur, on grids of points."""

import numpy as np
import pytest

from rig.arrays import Float
from rig.errors import TargetError
from rig.targets import corners, placing
from rig.targets.checkerboard import Checkerboard
from rig.targets.corner_fit import CrossingFit
from rig.targets.corners import Corners
from rig.targets.lattice import Lattice

BOARD = Checkerboard(5, 4, 25.0)


def grid(rows: int = 4, columns: int = 5, side_px: float = 20.0) -> Float:
    row, column = np.mgrid[:rows, :columns].astype(np.float64)
    return side_px * np.stack([column, row], axis=-1) + np.array([50.0, 60.0])


def black_first(rows: int = 4, columns: int = 5) -> Lattice:
    """Towards the lower right of (0, 0) is black: the bright quadrants are the other two."""
    row, column = np.indices((rows, columns))
    towards = np.where((row + column) % 2 == 0, -1.0, 1.0)
    bright = towards[..., None] * np.array([np.cos(np.pi / 2), np.sin(np.pi / 2)])
    return Lattice(grid(rows, columns), bright)


@pytest.mark.parametrize("quarters", range(4))
def test_a_lattice_is_turned_to_the_boards_order(quarters: int) -> None:
    turned = Lattice(
        np.rot90(black_first().xy_px, quarters), np.rot90(black_first().bright, quarters)
    )
    found = corners._oriented(turned, BOARD)
    assert found is not None
    assert found.xy_px.tolist() == grid().tolist()


def test_colours_the_other_way_round_start_at_the_other_end() -> None:
    other = Lattice(grid(), -black_first().bright)
    found = corners._oriented(other, BOARD)
    assert found is not None
    assert found.xy_px.tolist() == grid()[::-1, ::-1].tolist()
    assert placing.black_first(black_first())
    assert not placing.black_first(other)


def test_where_both_ends_fit_the_one_at_the_top_left_is_first() -> None:
    both = black_first(4, 6)
    turned = Lattice(both.xy_px[::-1, ::-1], both.bright[::-1, ::-1])
    found = corners._oriented(turned, Checkerboard(6, 4, 25.0))
    assert found is not None
    assert found.xy_px.tolist() == both.xy_px.tolist()


def test_another_count_is_not_that_board() -> None:
    assert corners._oriented(black_first(4, 4), BOARD) is None
    assert corners._oriented(black_first(3, 5), BOARD) is None


def test_missing_corners_are_where_the_others_put_them() -> None:
    row, column = np.mgrid[:4, :5].astype(np.float64)
    below = 1 + 0.02 * column - 0.03 * row
    whole = np.stack([(20 * column + 3 * row + 50) / below, (18 * row + 60) / below], axis=-1)
    seen = whole.copy()
    seen[0, 0] = seen[2, 3] = np.nan
    assert placing.completed(seen) == pytest.approx(whole, abs=1e-4)
    assert (placing.completed(whole) == whole).all()


def test_missing_corners_at_the_rim_of_a_fisheye_are_near_enough_to_be_fitted() -> None:
    """An equidistant fisheye, and a board from its middle to 58 degrees off its axis."""
    x, y = np.meshgrid(np.linspace(-0.95, 0.25, 9), np.linspace(-0.5, 0.5, 6))
    beside = np.hypot(x, y)
    away_px = 230.0 * np.arctan(1.5 * beside) / np.maximum(beside, 1e-12)
    whole = np.stack([320.0 + away_px * x, 240.0 + away_px * y], axis=-1)
    for corner in ((0, 0), (-1, 0)):
        seen = whole.copy()
        seen[corner] = np.nan
        assert np.linalg.norm(placing.completed(seen)[corner] - whole[corner]) < 1.5


@pytest.mark.parametrize(
    ("blur_px", "level", "levels", "suits"),
    [
        (0.99, 1, 3, 0), (1.0, 1, 3, 1), (2.5, 1, 3, 1), (2.51, 1, 3, 2), (2.51, 2, 3, 2),
        (0.5, 0, 3, 0), (0.5, 2, 3, 1), (3.0, 0, 1, 0), (3.0, 0, 2, 1),
    ],
)  # fmt: skip
def test_edges_are_measured_where_they_are_one_to_two_and_a_half_pixels_wide(
    blur_px: float, level: int, levels: int, suits: int
) -> None:
    assert corners._suiting(blur_px, level, levels) == suits


def fit(xy_px: Float, contrast: Float) -> CrossingFit:
    return CrossingFit(xy_px.reshape(-1, 2), np.ones(20), np.ones(20), contrast.ravel())


WHOLE = np.ones((4, 5), np.bool_)
TURN = np.where(np.indices((4, 5)).sum(axis=0) % 2, -100.0, 100.0)


def is_whole(xy_px: Float, contrast: Float) -> bool:
    return corners._on_board(fit(xy_px, contrast), WHOLE) is not None


def test_a_board_has_colours_in_turn_and_smooth_lines() -> None:
    assert is_whole(grid(), TURN)
    assert is_whole(grid(), -TURN)
    one_wrong = TURN.copy()
    one_wrong[2, 2] *= -1
    assert not is_whole(grid(), one_wrong)
    assert not is_whole(grid(), np.abs(TURN))
    gone = grid()
    gone[3, 4] = np.nan
    assert not is_whole(gone, TURN)
    for axis in (0, 1):
        for off_px, is_smooth in ((2.5, True), (4.0, False)):
            bent = grid()
            bent[2, 2, axis] += off_px  # changes steps by twice that: a quarter, two fifths
            assert is_whole(bent, TURN) is is_smooth


@pytest.mark.parametrize(
    ("name", "inside", "beyond"),
    [
        ("contrast", 36.0, 34.0),
        ("contrast", 36.0, -100.0),
        ("sigma_px", 5.9, 6.1),
        ("xy_px", 1.0, np.nan),
    ],
)
def test_of_a_part_corners_that_fit_the_others_stay(
    name: str, inside: float, beyond: float
) -> None:
    part = np.zeros((4, 5), np.bool_)
    part[:2] = True
    for value, stays in ((inside, True), (beyond, False)):
        one = {"contrast": TURN[part], "sigma_px": np.ones(10), "xy_px": grid()[part]}
        one[name] = one[name].copy()
        one[name][0] = value if name != "xy_px" else value * one[name][0]
        kept = corners._on_board(CrossingFit(blur_px=np.ones(10), **one), part)
        assert kept is not None
        assert bool(kept[0, 0]) is stays
        assert int(kept.sum()) == 9 + stays


def test_where_nothing_could_be_fitted_there_is_no_board() -> None:
    assert not is_whole(np.full((4, 5, 2), np.nan), TURN)


def test_a_part_has_two_fifths_of_the_corners() -> None:
    for count, is_enough in ((8, True), (7, False)):
        part = np.arange(20).reshape(4, 5) < count
        one = CrossingFit(grid()[part], np.ones(count), np.ones(count), TURN[part])
        assert (corners._on_board(one, part) is not None) is is_enough


def found(side_px: float, blur_px: float) -> Corners:
    return Corners(BOARD, grid(side_px=side_px), np.ones((4, 5)), blur_px, 100.0)


def test_small_and_blurred_boards_are_refused_at_their_limits() -> None:
    fine = found(6.0, 1.2)
    assert corners._checked(fine) is fine
    with pytest.raises(TargetError, match=r"squares of 5\.9 px") as small:
        corners._checked(found(5.9, 0.5))
    with pytest.raises(TargetError, match=r"blurred by 4\.1 px .* at most 4\.0 px") as blurred:
        corners._checked(found(20.0, 4.1))
    assert (small.value.reason, blurred.value.reason) == ("too-small", "blurred")


@pytest.mark.parametrize("shape", [(16, 15), (15, 16), (16, 16, 3)])
def test_a_picture_is_grey_and_of_sixteen_pixels_or_more(shape: tuple[int, ...]) -> None:
    with pytest.raises(TargetError, match="at least 16 x 16 finite pixels"):
        corners.find_corners(np.zeros(shape, np.uint8), BOARD)
    with pytest.raises(TargetError, match="dark picture"):
        corners.find_corners(np.zeros((16, 16), np.uint8), BOARD)


@pytest.mark.parametrize(("columns", "rows"), [(3, 3), (4, 3), (3, 4)])
def test_a_board_has_three_corners_each_way(columns: int, rows: int) -> None:
    board = Checkerboard(columns, rows, 2.0)
    assert board.has_one_way_up is ((columns + rows) % 2 == 1)
    assert board.points_mm.shape == (rows, columns, 3)
    assert board.points_mm[-1, -1].tolist() == [2.0 * (columns - 1), 2.0 * (rows - 1), 0.0]


def test_motion_is_the_root_of_the_mean_squared_distance() -> None:
    moved = grid()
    moved[0, 0] += (3.0, 4.0)
    moved[3, 2] += (0.0, -12.0)
    last = Corners(BOARD, moved, np.ones((4, 5)), 1.0, 100.0)
    assert corners.corner_motion_px(found(20.0, 1.0), last) == pytest.approx((169 / 20) ** 0.5)
