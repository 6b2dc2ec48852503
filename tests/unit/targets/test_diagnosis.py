"""Why a board was not found, decided on lattices and pictures whose numbers stand at the limits."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from rig.arrays import Float
from rig.errors import TargetError
from rig.frames import GreyImage
from rig.targets import CharucoBoard
from rig.targets import checkerboard_diagnosis as diagnosis
from rig.targets.charuco.diagnosis import _across, _blur_px, _holds
from rig.targets.charuco.grid_fit import GridFits, has_square
from rig.targets.checkerboard import Checkerboard
from rig.targets.checkerboard_diagnosis import exposure_at_fault, why_not
from rig.targets.lattice import Lattice
from rig.targets.measurable import check_measurable

GREY = np.full((100, 200), 120, np.uint8)
SHAPE = (100, 200)
SOME = (slice(3), slice(3))


def lattice(
    rows: int, columns: int, side_px: float = 10.0, at: tuple[float, float] = (60.0, 30.0)
) -> Lattice:
    row, column = np.mgrid[:rows, :columns].astype(np.float64)
    xy_px = side_px * np.stack([column, row], axis=-1) + np.array(at)
    return Lattice(xy_px, np.ones_like(xy_px))


def without(seen: Lattice, *places: tuple[int, int]) -> Lattice:
    xy_px = seen.xy_px.copy()
    for place in places:
        xy_px[place] = np.nan
    return Lattice(xy_px, seen.bright)


def drawn(*seen: Lattice, paper_squares: float = 0.5) -> NDArray[np.uint8]:
    """Boards whose corners are those of upright lattices, the outer squares and paper around."""
    y, x = np.mgrid[:100, :200].astype(np.float64)
    image = GREY.copy()
    for one in seen:
        side_px = float(np.nanmedian(np.diff(one.xy_px[..., 0], axis=1)))
        first = np.nanmin(one.xy_px, axis=(0, 1))
        column, row = (x - first[0]) / side_px, (y - first[1]) / side_px
        rows, columns = one.shape
        beyond = np.maximum(
            np.abs(column - (columns - 1) / 2) - (columns + 1) / 2,
            np.abs(row - (rows - 1) / 2) - (rows + 1) / 2,
        )
        squares = np.where((np.floor(column) + np.floor(row)) % 2 == 0, 40, 200)
        image = np.where(beyond < paper_squares, 200, image)
        image = np.where(beyond < 0, squares, image)
    return image.astype(np.uint8)


def reason(
    seen: Lattice, columns: int = 5, rows: int = 4, image: NDArray[np.uint8] | None = None
) -> TargetError:
    image = drawn(seen) if image is None else image
    return why_not(image, Checkerboard(columns, rows, 25.0), [seen.part(SOME), seen])


def test_more_corners_than_asked_for_are_another_board() -> None:
    for rows, columns in ((5, 5), (4, 6), (6, 4), (7, 7)):
        error = reason(lattice(rows, columns, 7.0))
        assert error.reason == "wrong-count"
        assert f"found {max(rows, columns)} x {min(rows, columns)} inner corners" in str(error)
        assert "use the other board" in str(error)
    assert "found at least 6 x 5 inner" in str(reason(without(lattice(5, 6), (2, 2))))
    assert "found at least 6 x 5 inner" in str(reason(lattice(5, 6, at=(4.0, 30.0))))


def test_fewer_corners_that_are_whole_are_one_of_another_count() -> None:
    error = reason(lattice(4, 4))
    assert error.reason == "wrong-count"
    assert "found one of 4 x 4 inner corners; set columns and rows to 4 x 4" in str(error)


def test_the_right_count_with_gaps_is_covered() -> None:
    for seen in (lattice(4, 5), without(lattice(5, 4), (1, 1))):
        error = reason(seen)
        assert error.reason == "not-found"
        assert f"found {int(seen.found.sum())} corners on a lattice of 5 x 4" in str(error)


def test_fewer_corners_that_do_not_end_on_all_sides_are_a_part_unknown() -> None:
    seen = lattice(3, 4)
    whole = drawn(lattice(4, 5))
    for found in (
        reason(seen, image=whole),
        reason(seen, image=drawn(seen, paper_squares=0.0)),
    ):
        assert found.reason == "which-part"
        assert "not which part of the board" in str(found)
    assert "found 12 corners on a lattice of 4 x 3" in str(reason(seen, image=whole))
    assert "or set columns and rows to 4 x 3 if that is all" in str(reason(seen, image=whole))


def test_squares_have_two_colours_or_are_no_board() -> None:
    seen = lattice(4, 5)
    assert diagnosis.is_board_like(drawn(seen).astype(np.float32), seen)
    stripes = np.where(np.indices(SHAPE)[1] % 20 < 10, 40.0, 200.0).astype(np.float32)
    assert not diagnosis.is_board_like(stripes, seen)
    assert not diagnosis.is_board_like(GREY.astype(np.float32), seen)
    assert reason(seen, image=GREY).reason == "not-found"


@pytest.mark.parametrize(("marker", "of_checkers", "of_charuco"), [(0, 1, 1), (90, 0, 1)])
def test_white_squares_with_markers_are_uneven(
    marker: int, of_checkers: bool, of_charuco: bool
) -> None:
    seen = lattice(4, 5, 10.0)
    image = drawn(seen).astype(np.float32)
    y, x = np.indices(SHAPE)
    image[(image == 200.0) & ((x % 10 == 3) | (y % 10 == 3))] -= marker
    assert diagnosis.is_board_like(image, seen) is bool(of_checkers)
    assert diagnosis.is_board_like(image, seen, with_markers=True) is bool(of_charuco)


def test_corners_up_to_a_border_are_clipped() -> None:
    error = reason(lattice(4, 4, at=(13.0, 30.0)))
    assert error.reason == "clipped"
    assert "found 4 x 4 corners up to the left border" in str(error)
    both = reason(lattice(4, 4, at=(186.0 - 30.0, 13.0)))
    assert "up to the right and top border" in str(both)
    # All that were asked for, and one of them nearer to the border than can be fitted.
    assert reason(lattice(4, 5, at=(3.0, 30.0))).reason == "clipped"
    assert reason(lattice(4, 5, at=(5.0, 30.0))).reason == "not-found"


def test_the_largest_plane_counts_and_its_squares_are_large_enough() -> None:
    error = reason(lattice(4, 5, 5.9))
    assert error.reason == "too-small"
    assert "found 5 x 4 corners on squares of 5.9 px, at least 6 px" in str(error)
    assert reason(lattice(4, 5, 6.0)).reason == "not-found"


@pytest.mark.parametrize(("share", "is_plane"), [(0.109, True), (0.111, False)])
def test_a_board_is_flat_to_eleven_hundredths_of_a_square(share: float, is_plane: bool) -> None:
    """A checkered offset, which no homography follows; the median side is one of a column."""
    row, column = np.indices((6, 8))
    sign = np.where((row + column) % 2, 1, -1)
    for axis in (0, 1):
        seen = lattice(6, 8, 20.0)
        off_px = 20.0 * share / np.sqrt(1 - 4 * share**2)
        seen.xy_px[..., axis] += off_px * sign
        apart_px = np.hypot(*(seen.xy_px - lattice(6, 8, 20.0).xy_px).T)
        assert apart_px == pytest.approx(np.full((8, 6), off_px))
        assert off_px == pytest.approx(share * seen.side_px, rel=0.03)
        assert diagnosis._is_plane(seen) is is_plane


def test_nine_corners_are_the_fewest() -> None:
    assert diagnosis._is_plane(lattice(3, 3))
    assert not diagnosis._is_plane(without(lattice(3, 3), (0, 0)))
    assert diagnosis._is_plane(without(lattice(3, 4), (0, 0), (0, 1), (2, 3)))
    alone = why_not(GREY, Checkerboard(5, 4, 25.0), [without(lattice(3, 3), (0, 0))])
    assert "nothing like a checkerboard found" in str(alone)


@pytest.mark.parametrize(
    ("at", "borders"),
    [
        ((3.9, 50.0), ["left"]),
        ((4.0, 50.0), []),
        ((195.0, 50.0), []),
        ((195.1, 50.0), ["right"]),
        ((50.0, 3.9), ["top"]),
        ((50.0, 4.0), []),
        ((50.0, 95.0), []),
        ((50.0, 95.1), ["bottom"]),
        ((3.0, 99.0), ["left", "bottom"]),
    ],
)
def test_corners_need_four_pixels_to_the_border(
    at: tuple[float, float], borders: list[str]
) -> None:
    points = np.array([[100.0, 50.0], [np.nan, np.nan], at])
    assert diagnosis.at_border(points, SHAPE) == borders


@pytest.mark.parametrize(
    ("at", "borders"),
    [
        ((14.5, 30.0), []),
        ((13.5, 30.0), ["left"]),
        ((164.5, 30.0), []),
        ((165.5, 30.0), ["right"]),
        ((60.0, 14.5), []),
        ((60.0, 13.5), ["top"]),
        ((60.0, 64.5), []),
        ((60.0, 65.5), ["bottom"]),
    ],
)
def test_the_next_line_of_corners_tells_what_is_clipped(
    at: tuple[float, float], borders: list[str]
) -> None:
    """Three by three corners, ten pixels apart: the next ones lie ten pixels on."""
    assert diagnosis._touched(lattice(3, 3, at=at), SHAPE) == borders


def saturated(share: float, full: int, kind: type[np.uint8] | type[np.uint16]) -> GreyImage:
    levels = np.where(np.arange(1000) < round(1000 * share), full, full // 2)
    image = levels.reshape(20, 50)
    return image.astype(np.uint8) if kind is np.uint8 else image.astype(np.uint16)


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (saturated(0.2, 255, np.uint8), None),
        (saturated(0.201, 255, np.uint8), "saturated at 255"),
        (saturated(0.201, 1023, np.uint16), "saturated at 1023"),
        (saturated(0.201, 4095, np.uint16), "saturated at 4095"),
        (saturated(0.201, 16383, np.uint16), "saturated at 16383"),
        (saturated(0.201, 65535, np.uint16), "saturated at 65535"),
        (np.full((20, 50), 31, np.uint8), None),
        (np.full((20, 50), 30, np.uint8), "brightest pixels at 30 of 255"),
        (np.full((20, 50), 122, np.uint16), "brightest pixels at 122 of 1023"),
        (np.full((20, 50), 123, np.uint16), None),
    ],
)
def test_exposure_is_blamed_beyond_its_limits(image: GreyImage, reason: str | None) -> None:
    error = exposure_at_fault(image, "asked")
    assert (error is None) if reason is None else reason in str(error)


CHARUCO = CharucoBoard(7, 5, 25.0, 18.75, "4X4_50")


def test_squares_of_six_pixels_with_edges_of_a_fifth_can_be_measured() -> None:
    check_measurable("board", 6.0, 1.2)
    with pytest.raises(TargetError, match=r"squares of 5\.9 px, at least 6 px") as small:
        check_measurable("board", 5.9, 0.0)
    with pytest.raises(TargetError, match=r"blurred by 4\.1 px .* at most 4\.0 px") as blurred:
        check_measurable("board", 20.0, 4.1)
    assert (small.value.reason, blurred.value.reason) == ("too-small", "blurred")


@pytest.mark.parametrize(("blur_px", "reason"), [(1.49, "too-small"), (1.51, "blurred")])
def test_squares_in_focus_are_small_before_they_are_blurred(blur_px: float, reason: str) -> None:
    check_measurable("board", 7.6, blur_px)
    with pytest.raises(TargetError) as refused:
        check_measurable("board", 7.4, blur_px)
    assert refused.value.reason == reason


@pytest.mark.parametrize("blur_px", [1.0, 2.0])
def test_blur_is_told_from_edges_across_the_sides(blur_px: float) -> None:
    """A blurred chess pattern as a product of two waves of normal integrals."""
    place = np.arange(140.0)[:, None]
    edges = 9.5 + 20.0 * np.arange(7)
    signs = np.where(np.arange(7) % 2, -1.0, 1.0)
    wave = (2 * signs * norm.cdf((place - edges) / blur_px)).sum(axis=1) - 1
    picture = (100 + 60 * wave[:, None] * wave).astype(np.float32)
    row, column = np.mgrid[:7, :7]
    xy_px = 9.5 + 20.0 * np.stack([column, row], axis=-1)
    seen = Lattice(xy_px, np.ones_like(xy_px))
    assert _blur_px(picture, seen) == pytest.approx(blur_px, rel=0.11)
    assert _blur_px(picture, without(seen, (0, 0), (3, 4))) == pytest.approx(blur_px, rel=0.11)


def test_numbers_grow_by_the_squares_across_two_rows_on() -> None:
    assert _across({(0, 0): 3, (2, 0): 10, (1, 1): 7}) == 7
    assert _across({(0, 0): 3, (2, 0): 10, (2, 1): 13, (4, 1): 18, (4, 0): 17}) == 7
    assert _across({(0, 0): 3, (1, 0): 10, (3, 1): 13}) is None


def test_small_dictionaries_are_the_beginning_of_large_ones() -> None:
    assert _holds("4X4_1000", "4X4_50")
    assert _holds("4X4_50", "4X4_50")
    assert not _holds("4X4_50", "4X4_1000")
    assert not _holds("5X5_1000", "4X4_50")
    assert not _holds("APRILTAG_16H5", "4X4_50")


def fits(**changes: Float) -> GridFits:
    """Two by three corners; colours in turn, all alike."""
    turn = np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]])
    values = {
        "xy_px": np.zeros((2, 3, 2)),
        "sigma_px": np.full((2, 3), 0.1),
        "blur_px": np.ones((2, 3)),
        "contrast": 100.0 * turn,
        "moved": np.zeros((2, 3)),
    }
    return GridFits(**(values | changes))


def at_first(value: float, others: Float) -> Float:
    changed = others.copy()
    changed[0, 0] = value
    return changed


def test_corners_are_good_in_place_as_strong_and_as_sharp_as_the_others() -> None:
    even = fits()
    assert even.good.all()
    assert fits(contrast=-even.contrast).good.all()
    for name, inside, beyond in (
        ("contrast", 36.0, 34.0),
        ("contrast", 100.0, -100.0),
        ("moved", 0.099, 0.101),
        ("sigma_px", 0.59, 0.61),
        ("sigma_px", 0.1, 0.0),
        ("sigma_px", 0.1, np.nan),
    ):
        others = getattr(even, name)
        assert fits(**{name: at_first(inside, others)}).good.all()
        found = fits(**{name: at_first(beyond, others)}).good
        assert found.tolist() == [[False, True, True], [True, True, True]]


def test_nothing_usable_is_nothing_good() -> None:
    assert not fits(sigma_px=np.full((2, 3), np.nan)).good.any()
    assert not fits(moved=np.ones((2, 3))).good.any()
    assert fits(blur_px=at_first(np.nan, np.ones((2, 3)))).tried.tolist() == [
        [False, True, True],
        [True, True, True],
    ]


@pytest.mark.parametrize("missing", [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_a_square_has_four_corners(missing: tuple[int, int]) -> None:
    found = np.ones((2, 2), np.bool_)
    assert has_square(found)
    found[missing] = False
    assert not has_square(found)
    assert has_square(np.pad(np.ones((2, 2), np.bool_), ((1, 0), (0, 2))))
