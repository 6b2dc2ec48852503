import numpy as np
import pytest

from rig.errors import ConfigError
from rig.targets.checkerboard import Checkerboard


def test_points_run_right_then_down_from_the_first_corner():
    points = Checkerboard(9, 6, 25.0).points_mm
    assert points.shape == (6, 9, 3)
    assert points[0, 1].tolist() == [25.0, 0.0, 0.0]
    assert points[1, 0].tolist() == [0.0, 25.0, 0.0]


@pytest.mark.parametrize(
    ("columns", "rows", "one_way"), [(9, 6, True), (8, 6, False), (7, 5, False)]
)
def test_parity_tells_which_end_is_up(columns: int, rows: int, one_way: bool):
    assert Checkerboard(columns, rows, 10.0).has_one_way_up is one_way


@pytest.mark.parametrize("board", [(2, 6, 25.0), (9, 2, 25.0), (9, 6, 0.0), (9, 6, np.nan)])
def test_impossible_boards_are_refused(board: tuple[int, int, float]):
    with pytest.raises(ConfigError):
        Checkerboard(*board)
