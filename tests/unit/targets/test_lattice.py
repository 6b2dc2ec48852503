"""Links and lattices of saddles on grids whose every neighbour is known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.targets import lattice as lattices
from rig.targets import links
from rig.targets.lattice import Lattice, cut_to_size, grow_lattices, without_strays
from rig.targets.links import neighbours
from rig.targets.saddles import Saddles


def board(rows: int, columns: int, *, side_px: float = 20.0, turn_deg: float = 0.0) -> Saddles:
    """Corners row by row from (0, 0), bright to the lower right of those of even number."""
    row, column = np.mgrid[:rows, :columns]
    turn = np.radians(turn_deg)
    right, down = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    xy_px = side_px * (column.reshape(-1, 1) * right + row.reshape(-1, 1) * down)
    sign = np.where((row + column).ravel() % 2 == 0, 1.0, -1.0)
    towards = 2 * (turn + np.pi / 4)
    bright = sign[:, None] * np.array([np.cos(towards), np.sin(towards)])
    axes = np.broadcast_to(np.stack([right, down]), (rows * columns, 2, 2)).copy()
    return Saddles(xy_px, axes, bright, np.full(rows * columns, 100.0))


def moved(saddles: Saddles, index: int, xy_px: tuple[float, float]) -> Saddles:
    places = saddles.xy_px.copy()
    places[index] = xy_px
    return Saddles(places, saddles.axes, saddles.bright, saddles.contrast)


def chosen(rows: int, columns: int) -> NDArray[np.intp]:
    number = np.arange(rows * columns).reshape(rows, columns)
    padded = np.pad(number, 1, constant_values=-1)
    around = [padded[1:-1, 2:], padded[1:-1, :-2], padded[2:, 1:-1], padded[:-2, 1:-1]]
    return np.stack(around, axis=-1).reshape(-1, 2, 2)


@pytest.mark.parametrize("turn_deg", [0.0, 37.0, 120.0])
def test_neighbours_are_those_of_the_grid(turn_deg: float) -> None:
    found = neighbours(board(4, 5, turn_deg=turn_deg), None)
    assert found.tolist() == chosen(4, 5).tolist()


def test_one_saddle_and_two_of_one_colour_have_no_neighbours() -> None:
    assert neighbours(board(1, 1), None).tolist() == [[[-1, -1], [-1, -1]]]
    pair = board(1, 2)
    assert neighbours(pair, None).tolist() == [[[1, -1], [-1, -1]], [[-1, 0], [-1, -1]]]
    alike = Saddles(pair.xy_px, pair.axes, pair.bright[[0, 0]], pair.contrast)
    assert (neighbours(alike, None) == -1).all()


@pytest.mark.parametrize(("cosine", "is_one"), [(-0.61, True), (-0.59, False)])
def test_neighbours_have_opposite_colours_by_a_cosine(cosine: float, is_one: bool) -> None:
    pair = board(1, 2)
    bright = np.array([[0.0, 1.0], [np.sqrt(1 - cosine**2), cosine]])
    found = neighbours(Saddles(pair.xy_px, pair.axes, bright, pair.contrast), None)
    assert bool((found >= 0).any()) is is_one


@pytest.mark.parametrize(("sine", "is_one"), [(0.39, True), (0.41, False)])
@pytest.mark.parametrize("at", [0, 1])
def test_neighbours_lie_along_an_axis_of_both(sine: float, is_one: bool, at: int) -> None:
    pair = board(1, 2)
    axes = pair.axes.copy()
    right = np.array([np.sqrt(1 - sine**2), sine])
    axes[at] = np.stack([right, [-right[1], right[0]]])
    found = neighbours(Saddles(pair.xy_px, axes, pair.bright, pair.contrast), None)
    assert bool((found >= 0).any()) is is_one


@pytest.mark.parametrize(("away_px", "is_one"), [(49.0, True), (51.0, False)])
def test_a_step_of_over_two_and_a_half_others_has_jumped(away_px: float, is_one: bool) -> None:
    three = moved(board(1, 3), 2, (20.0 + away_px, 0.0))
    found = neighbours(three, None)
    assert found[1].tolist() == [[2 if is_one else -1, 0], [-1, -1]]
    assert found[2].tolist() == [[-1, 1 if is_one else -1], [-1, -1]]


def test_of_several_along_one_direction_the_nearest_counts() -> None:
    four = board(1, 4)  # 0 sees 1 and 3, which have the other colour
    assert neighbours(four, None)[0].tolist() == [[1, -1], [-1, -1]]
    reverse = four.xy_px[::-1], four.axes[::-1], four.bright[::-1], four.contrast
    far_first = Saddles(*reverse)
    assert neighbours(far_first, None)[3].tolist() == [[2, -1], [-1, -1]]


def test_a_choice_that_is_not_returned_is_none() -> None:
    flat = np.array([[[1, -1], [2, -1]], [[0, -1], [-1, -1]], [[1, -1], [-1, -1]]])
    assert links._mutual(flat).tolist() == [
        [[1, -1], [-1, -1]], [[0, -1], [-1, -1]], [[-1, -1], [-1, -1]],
    ]  # fmt: skip


def test_links_of_a_picture_are_longer_than_nine_pixels() -> None:
    y, x = np.mgrid[:60, :60]
    for side_px, count in ((8, 0), (10, 24)):
        picture = np.where((x // side_px + y // side_px) % 2 == 0, 160.0, 60.0)
        even = board(3, 3, side_px=side_px)
        saddles = Saddles(even.xy_px + 2 * side_px - 0.5, even.axes, even.bright, even.contrast)
        found = neighbours(saddles, picture.astype(np.float32))
        assert (found >= 0).sum() == count


def test_the_shortest_of_a_point_are_looked_at() -> None:
    """A star: point 0 has 30 links, the longest first; each other point has one."""
    last = np.arange(1, 31)
    star = links._Links(np.zeros(30, np.intp), last, np.linspace(60.0, 31.0, 30))
    kept = links._shortest(star, 31)
    assert kept.last.tolist() == list(range(7, 31))
    assert kept.length_px.tolist() == star.length_px[6:].tolist()


@pytest.mark.parametrize("turn_deg", [0.0, 37.0, 120.0])
def test_a_board_grows_whole_in_one_orientation(turn_deg: float) -> None:
    saddles = board(4, 5, turn_deg=turn_deg)
    (found,) = grow_lattices(saddles)
    assert found.shape == (4, 5)
    assert found.xy_px.reshape(-1, 2) == pytest.approx(saddles.xy_px)
    assert found.bright.reshape(-1, 2) == pytest.approx(saddles.bright)
    assert found.side_px == pytest.approx(20.0)


def test_axes_of_any_order_and_sign_grow_the_same_board() -> None:
    saddles = board(4, 5, turn_deg=20.0)
    numbers = np.random.default_rng(2)
    axes = saddles.axes * numbers.choice([-1.0, 1.0], (20, 2, 1))
    swapped = numbers.random(20) < 0.5
    axes[swapped] = axes[swapped][:, ::-1]
    (found,) = grow_lattices(Saddles(saddles.xy_px, axes, saddles.bright, saddles.contrast))
    assert sorted(found.shape) == [4, 5]
    right, down = found.xy_px[0, 1] - found.xy_px[0, 0], found.xy_px[1, 0] - found.xy_px[0, 0]
    assert right[0] * down[1] - right[1] * down[0] == pytest.approx(400.0)
    assert np.diff(found.xy_px, 2, 0) == pytest.approx(0.0, abs=1e-9)
    assert np.diff(found.xy_px, 2, 1) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("rows", "columns", "fewest", "count"),
    [
        (3, 3, 9, 1),
        (2, 4, 9, 0),
        (2, 5, 9, 0),
        (2, 5, 8, 1),
        (2, 2, 4, 1),
        (2, 2, 5, 0),
        (1, 6, 4, 0),
    ],
)
def test_few_corners_are_chance(rows: int, columns: int, fewest: int, count: int) -> None:
    found = grow_lattices(board(rows, columns), fewest=fewest)
    assert [one.shape for one in found] == [(rows, columns)] * count


def test_the_largest_comes_first() -> None:
    small, large = board(3, 3), board(3, 4)
    parts = zip(
        (small.xy_px, small.axes, small.bright, small.contrast),
        (large.xy_px + np.array([1000.0, 0.0]), large.axes, large.bright, large.contrast),
        strict=True,
    )
    found = grow_lattices(Saddles(*(np.concatenate(pair) for pair in parts)))
    assert [one.shape for one in found] == [(3, 4), (3, 3)]


def grid(rows: int, columns: int, side_px: float = 20.0) -> Lattice:
    row, column = np.mgrid[:rows, :columns].astype(np.float64)
    xy_px = side_px * np.stack([column, row], axis=-1)
    return Lattice(xy_px, np.ones_like(xy_px))


def with_missing(lattice: Lattice, *places: tuple[int, int]) -> Lattice:
    xy_px, bright = lattice.xy_px.copy(), lattice.bright.copy()
    for place in places:
        xy_px[place] = bright[place] = np.nan
    return Lattice(xy_px, bright)


def test_a_lattice_knows_its_corners_and_the_median_side() -> None:
    some = with_missing(grid(3, 4), (0, 0), (2, 3))
    assert some.shape == (3, 4)
    assert int(some.found.sum()) == 10
    assert not some.found[0, 0]
    assert some.side_px == 20.0
    assert np.isnan(with_missing(grid(1, 2), (0, 1)).side_px)
    uneven = Lattice(
        np.array([[[0.0, 0.0], [10.0, 0.0]], [[0.0, 30.0], [14.0, 30.0]]]), np.ones((2, 2, 2))
    )
    # 10 and 14 across, 30 and a little more down.
    assert uneven.side_px == pytest.approx(22.0)


@pytest.mark.parametrize(("off_px", "is_kept"), [(3.69, True), (3.71, False)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_corner_off_every_line_is_a_stray(off_px: float, is_kept: bool, axis: int) -> None:
    """The change of step next to it is its offset: allowed are 15 % of 20 px and 0.7 px."""
    lattice = grid(7, 7)
    lattice.xy_px[3, 3, axis] += off_px
    found = without_strays(lattice, 0.5)
    assert int(found.found.sum()) == 48 + is_kept
    assert bool(found.found[3, 3]) is is_kept
    assert np.isnan(found.bright[3, 3]).any() != is_kept


def test_a_stray_takes_neighbours_along_that_have_no_other_line() -> None:
    lattice = grid(5, 5)
    lattice.xy_px[2, 2] += (3.0, 8.0)
    keep = lattices._on_smooth_lines(lattice.xy_px)
    assert np.argwhere(~keep).tolist() == [
        [0, 2],
        [1, 2],
        [2, 0],
        [2, 1],
        [2, 2],
        [2, 3],
        [2, 4],
        [3, 2],
        [4, 2],
    ]


def test_outer_lines_go_while_they_are_less_than_half_full() -> None:
    lattice = with_missing(grid(5, 6), (0, 0), (0, 1), (0, 2), (0, 3), *((r, 5) for r in (1, 2)))
    found = without_strays(lattice, 0.5)
    # The first row holds 2 of 6; then the last column holds 2 of 4, which is half.
    assert found.shape == (4, 6)
    assert found.xy_px[0, 0].tolist() == [0.0, 20.0]
    assert without_strays(lattice, 0.51).shape == (4, 5)
    assert without_strays(with_missing(grid(5, 6), *((4, c) for c in range(4))), 0.5).shape == (
        4,
        6,
    )
    assert without_strays(with_missing(grid(5, 6), *((r, 0) for r in range(3))), 0.5).shape == (
        5,
        5,
    )


def test_a_lattice_is_cut_to_a_shape_only_by_lines_that_are_nearly_empty() -> None:
    lattice = with_missing(grid(5, 6), *((r, 0) for r in (0, 1, 2, 3)), *((4, c) for c in (1, 2)))
    # Of the first column 1 of 5 is there, of the last row 4 of 6.
    cut = cut_to_size(lattice, (5, 5), 0.5)
    assert cut is not None
    assert cut.xy_px[0, 0].tolist() == [20.0, 0.0]
    assert cut_to_size(lattice, (4, 6), 0.5) is None
    assert cut_to_size(lattice, (5, 5), 0.2) is None
    assert cut_to_size(lattice, (5, 5), 0.21) is not None
    assert cut_to_size(lattice, (4, 5), 0.67) is not None
    assert cut_to_size(lattice, (6, 6), 0.5) is None
    assert cut_to_size(lattice, (5, 6), 0.5) is lattice
    assert cut_to_size(lattice, (5, 4), 0.5) is None


def test_ends_are_told_with_the_rest_of_the_lattice() -> None:
    lattice = with_missing(grid(3, 4), (0, 1), (1, 3), (2, 3))
    ends = lattices._ends(lattice, axes=(0, 1))
    assert [filled for filled, _ in ends] == pytest.approx([0.75, 0.75, 1.0, 1 / 3])
    assert [lattice.part(rest).xy_px[-1, 0, 1] for _, rest in ends] == [40.0, 20.0, 40.0, 40.0]
    assert [lattice.part(rest).shape for _, rest in ends] == [(2, 4), (2, 4), (3, 3), (3, 3)]
    assert [lattice.part(rest).xy_px[1, 0, 0] for _, rest in ends] == [0.0, 0.0, 20.0, 0.0]
