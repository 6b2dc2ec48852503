"""Where board, ruler and text stand on a page, in mm."""

from itertools import pairwise

import pytest

from rig.errors import ConfigError
from rig.targets import CharucoBoard
from rig.targets.checkerboard import Checkerboard
from rig.targets.printing.drawing import Drawing
from rig.targets.printing.sheet import draw_sheet

BOARD = Checkerboard(4, 3, 20.0)
"""5 x 4 squares: 100 x 80 mm."""


def extent(drawing: Drawing, part: int) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of an area."""
    rects = drawing.areas[part].rects
    return (
        min(r.x_mm for r in rects),
        min(r.y_mm for r in rects),
        max(r.x_mm + r.width_mm for r in rects),
        max(r.y_mm + r.height_mm for r in rects),
    )


def test_board_ruler_and_text_stand_below_each_other_in_the_middle() -> None:
    sheet = draw_sheet(BOARD, (200.0, 300.0), 5.0)
    # The board is wider than high, so the page lies across. Needed are 80 + 17 + 10 mm of 200.
    assert (sheet.width_mm, sheet.height_mm) == (300.0, 200.0)
    top_mm = 5.0 + (200.0 - 107.0) / 2
    assert extent(sheet, 0) == pytest.approx((100.0, top_mm, 200.0, top_mm + 80.0))
    left, top, right, bottom = extent(sheet, -1)
    assert (left, right) == pytest.approx((100.0, 200.0))
    assert (top, bottom) == pytest.approx((top_mm + 83.0, top_mm + 83.0 + 3.2))
    assert [line.x_mm for line in sheet.lines] == [100.0, 100.0]
    assert [line.y_mm for line in sheet.lines] == pytest.approx([top_mm + 90.0, top_mm + 93.2])


def test_the_ruler_has_a_tick_at_every_centimetre_and_longer_ones_at_five() -> None:
    rects = draw_sheet(BOARD, (300.0, 200.0), 5.0).areas[-1].rects
    ticks, spans = rects[:11], rects[11:]
    middles = [tick.x_mm + tick.width_mm / 2 - 100.0 for tick in ticks]
    assert middles == pytest.approx([0.1, *(10.0 * n for n in range(1, 10)), 99.9])
    assert [tick.height_mm for tick in ticks] == pytest.approx([3.2, *[2.0] * 4] * 2 + [3.2])
    assert {round(tick.width_mm, 9) for tick in ticks} == {0.2}
    assert len(spans) == 10
    for span, (one, other) in zip(spans, pairwise(ticks), strict=True):
        assert span.x_mm == pytest.approx(one.x_mm + 0.2)
        assert span.x_mm + span.width_mm == pytest.approx(other.x_mm)
        assert span.height_mm == 0.2


@pytest.mark.parametrize("page", [(110.0, 107.0), (107.0, 110.0)])
def test_a_page_that_just_fits_is_taken_either_way(page: tuple[float, float]) -> None:
    sheet = draw_sheet(BOARD, page, 5.0)
    assert (sheet.width_mm, sheet.height_mm) == (110.0, 107.0)
    assert extent(sheet, 0)[:2] == pytest.approx((5.0, 5.0))


@pytest.mark.parametrize("page", [(109.9, 107.0), (110.0, 106.9)])
def test_a_page_that_is_too_small_is_refused_with_what_is_needed(page: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match=r"needs a page of 110 x 107 mm, .* mm asked for"):
        draw_sheet(BOARD, page, 5.0)


def test_a_narrow_board_needs_room_for_its_ruler_and_an_inverted_one_for_its_ground() -> None:
    with pytest.raises(ConfigError, match="needs a page of 110 x 107 mm"):
        draw_sheet(Checkerboard(3, 3, 20.0), (90.0, 100.0), 5.0)
    board = CharucoBoard(6, 4, 20.0, 15.0, "4X4_50", inverted=True)
    with pytest.raises(ConfigError, match="needs a page of 150 x 127 mm"):
        draw_sheet(board, (90.0, 100.0), 5.0)
