"""Boards through lenses that bend their lines: found as true geometry puts them."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import TargetError
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.board_images import digitised
from tests.support.wide_board_images import WideBoard

WIDE = WideBoard(columns=8, rows=6, distance_mm=130.0, width=480, height=400)
ASIDE = WideBoard(
    columns=9, rows=6, distance_mm=200.0, off_axis_deg=(42.0, 180.0), tilt_deg=(0.0, -20.0, -5.0),
    width=480, height=400,
)  # fmt: skip
CORNER = WideBoard(
    columns=8, rows=6, distance_mm=150.0, off_axis_deg=(40.0, 35.0), tilt_deg=(20.0, -25.0, 8.0),
    width=480, height=400, across_deg=150.0,
)  # fmt: skip


def seen(board: WideBoard) -> np.ndarray:
    return digitised(board.clean(), noise=2.0, rng=np.random.default_rng(1))


@pytest.mark.slow
@pytest.mark.parametrize("board", [WIDE, CORNER, ASIDE], ids=["before", "corner", "aside"])
def test_all_corners_are_found_where_they_are(board: WideBoard) -> None:
    found = find_corners(seen(board), Checkerboard(board.columns, board.rows, board.square_mm))
    true = board.corners()
    error_px = min(
        float(np.sqrt(np.mean((found.xy_px - turned) ** 2))) for turned in (true, true[::-1, ::-1])
    )
    assert error_px < 0.1


def test_lines_of_this_board_bend_more_than_those_of_plain_lenses() -> None:
    step = np.diff(WIDE.corners(), axis=1)
    bend = np.linalg.norm(np.diff(step, axis=1), axis=-1)
    shorter = np.minimum(*(np.linalg.norm(part, axis=-1) for part in (step[:, 1:], step[:, :-1])))
    assert (bend / shorter).max() > 0.15


def test_a_board_that_leaves_the_picture_is_told_by_the_border() -> None:
    cut = replace(ASIDE, off_axis_deg=(60.0, 180.0))
    with pytest.raises(TargetError, match="up to the left border") as refused:
        find_corners(seen(cut), Checkerboard(9, 6, 25.0))
    assert refused.value.reason == "clipped"


def test_another_board_through_a_wide_lens_is_told_by_its_corners() -> None:
    with pytest.raises(TargetError, match="found one of 8 x 6 inner corners") as refused:
        find_corners(seen(WIDE), Checkerboard(9, 7, 25.0))
    assert refused.value.reason == "wrong-count"
