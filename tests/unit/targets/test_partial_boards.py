"""Checkerboards of which glare, a thumb or the border hides a part: numbered or refused."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.errors import TargetError
from rig.targets import find_target
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.support.board_images import BoardScene, digitised

SCENE = BoardScene(
    columns=8, rows=5, width=320, height=240, focal_px=480.0, tilt_deg=(8.0, 12.0, 5.0)
)
BOARD = Checkerboard(8, 5, 25.0)
CORNERS = SCENE.corners()


def picture() -> NDArray[np.uint8]:
    return digitised(SCENE.clean(), noise=1.0, rng=np.random.default_rng(4))


def covered(
    rows: tuple[float, float], columns: tuple[float, float], grey: int
) -> NDArray[np.uint8]:
    """Grey over a stretch of the board, from place to place in squares of corner (0, 0)."""
    around = [(rows[0], columns[0]), (rows[0], columns[1])]
    around += [(rows[1], columns[1]), (rows[1], columns[0])]
    places = np.array([[column, row, 1.0] for row, column in around])
    at = places @ SCENE.pixel_from_board().T
    at = at[:, :2] / at[:, 2:]
    y, x = np.mgrid[:240, :320].astype(np.float64)
    inside = np.ones((240, 320), np.bool_)
    for a, b in zip(at, np.roll(at, -1, axis=0), strict=True):
        inside &= (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0
    image = picture()
    image[inside] = grey
    return image


@pytest.mark.parametrize(
    ("rows", "columns", "grey", "hidden"),
    [
        ((1.3, 2.8), (2.4, 4.7), 255, {(2, 3), (2, 4)}),  # glare
        ((2.4, 9.0), (5.6, 9.0), 130, {(r, c) for r in (3, 4) for c in (6, 7)}),  # a thumb
        ((3.5, 9.0), (-3.0, 9.0), 130, {(4, c) for c in range(8)}),  # a hand along one side
        ((-3.0, 0.6), (-3.0, 9.0), 130, {(0, c) for c in range(8)}),
    ],
)  # fmt: skip
def test_what_is_seen_of_a_board_has_its_own_numbers(
    rows: tuple[float, float],
    columns: tuple[float, float],
    grey: int,
    hidden: set[tuple[int, int]],
) -> None:
    found = find_target(covered(rows, columns, grey), BOARD)
    error_px = found.xy_px - CORNERS.reshape(-1, 2)[found.ids]
    assert float(np.sqrt(np.mean(error_px**2))) < 0.05
    assert not hidden & {divmod(int(number), 8) for number in found.ids}
    assert len(found) >= 40 - len(hidden) - 9


def test_a_part_in_the_middle_is_told_to_be_of_unknown_place() -> None:
    image = covered((-3.0, 0.5), (-3.0, 10.0), 130)
    image = np.where(covered((3.5, 9.0), (-3.0, 10.0), 130) == 130, np.uint8(130), image)
    with pytest.raises(TargetError, match="not which part of the board they are") as refused:
        find_target(image, BOARD)
    assert refused.value.reason == "which-part"


def test_who_needs_all_corners_is_told_how_many_there_are() -> None:
    with pytest.raises(TargetError, match=r"found 3\d of 40; uncover the board") as refused:
        find_corners(covered((2.4, 9.0), (5.6, 9.0), 130), BOARD)
    assert refused.value.reason == "clipped"


def test_a_board_cut_off_at_one_side_counts_and_the_border_is_told_to_who_needs_all() -> None:
    cut = round(float(CORNERS[:, 6, 0].min())) - 4
    image = picture()[:, :cut]
    found = find_target(image, BOARD)
    assert set((found.ids % 8).tolist()) == set(range(6))
    error_px = found.xy_px - CORNERS.reshape(-1, 2)[found.ids]
    assert float(np.abs(error_px).max()) < 0.1
    with pytest.raises(TargetError, match="up to the right border of the picture"):
        find_corners(image, BOARD)


def test_a_board_within_a_larger_one_is_not_taken_for_it() -> None:
    larger = SCENE.with_changes(columns=9, rows=5)
    image = digitised(larger.clean(), noise=1.0, rng=np.random.default_rng(5))
    with pytest.raises(TargetError, match="9 x 5 inner corners") as refused:
        find_target(image, BOARD)
    assert refused.value.reason == "wrong-count"
