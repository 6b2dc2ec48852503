"""Steps of an estimate that decide by a limit, each from both sides."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar import estimate
from rig.epipolar.chessboard import thinned
from rig.epipolar.colour import luminance
from rig.epipolar.confidence import contradicted
from rig.epipolar.line import SEEN, LineFits
from rig.epipolar.occlusion import hidden_points
from rig.epipolar.placement.placement import Placement
from rig.epipolar.scales import Scales
from rig.epipolar.search.contrast import raise_texture, texture_levels
from rig.epipolar.search.found import Found
from rig.epipolar.search.halves import assign_halves
from rig.epipolar.search.penalties import fading_penalties, jump_penalties
from rig.epipolar.search.search import Effort, effort_of, wide_share
from rig.epipolar.search.window import Cameras, Window, window_of
from rig.epipolar.views import Label, SlopeMap, SlopePrior
from rig.errors import SlopeError

Map = NDArray[np.float32]
RNG = np.random.default_rng(121)
CROSS = Cameras(np.array([0.0, 1.0, -1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 2.0, -1.0]), 0)
PAIR = Cameras(np.array([0.0, 2.0]), np.zeros(2), 0)
SHAPE = (30, 40)


def filled(value: float, shape: tuple[int, int] = SHAPE) -> Map:
    return np.full(shape, value, np.float32)


def test_labels_are_four_tenths_of_a_pixel_apart_in_the_outermost_view():
    assert CROSS.step_px == pytest.approx(0.2)
    oblique = Cameras(np.array([0.0, 3.0]), np.array([0.0, -4.0]), 0)
    assert oblique.step_px == pytest.approx(0.08)


def test_a_window_covers_its_labels():
    window = Window(filled(-1.0), filled(1.1), filled(0.0))
    labels = window.labels(0.2)
    assert len(labels) == 12  # eleven steps, the last of them shorter
    assert labels[[0, -1]] == pytest.approx([-1.0, 1.1])
    assert np.diff(labels) == pytest.approx(np.full(11, 2.1 / 11), rel=1e-5)
    assert len(Window(filled(0.0), filled(0.1), filled(0.0)).labels(0.2)) == 3
    assert window.widest_px() == pytest.approx(2.1)
    assert window.is_wider(2.0).all()
    assert not window.is_wider(2.2).any()


def test_slopes_are_held_inside_their_window():
    window = Window(filled(-1.0, (1, 3)), filled(1.0, (1, 3)), filled(0.0, (1, 3)))
    assert window.hold(np.array([[-5.0, 0.5, 5.0]], np.float32)).tolist() == [[-1.0, 0.5, 1.0]]


@pytest.mark.parametrize(("shrink", "first"), [(2, 1), (3, 1), (4, 2), (5, 2)])
def test_a_window_of_smaller_pictures_has_smaller_slopes(shrink: int, first: int):
    low = RNG.uniform(-9, 0, (23, 31)).astype(np.float32)
    small = Window(low, low + 6, low + 3).shrunk(shrink)
    expected = low[first::shrink, first::shrink][: 23 // shrink, : 31 // shrink] / shrink
    assert small.low_px == pytest.approx(expected)
    assert small.high_px == pytest.approx(expected + 6 / shrink, abs=1e-5)
    assert small.expected_px == pytest.approx(expected + 3 / shrink, abs=1e-5)


def test_a_hypothesis_opens_two_sigmas_unless_it_says_nothing():
    slope = np.array([[0.0, 4.0, -9.0, np.nan, 1.0, 1.0]], np.float32)
    sigma = np.array([[0.5, 0.5, 0.5, 0.5, 2.49, 2.5]], np.float32)
    window = window_of((1, 6), (-6.0, 4.0), SlopePrior(slope, sigma))
    assert window.low_px[0] == pytest.approx([-1, 3, -10, -6, 1 - 4.98, -6])
    assert window.high_px[0] == pytest.approx([1, 5, -8, 4, 1 + 4.98, 4])
    assert window.expected_px[0] == pytest.approx([0, 4, -9, -1, 1, 1])
    whole = window_of((2, 2), (-6.0, 4.0), None)
    assert (whole.low_px == -6).all()
    assert (whole.high_px == 4).all()
    assert (whole.expected_px == -1).all()


def test_a_hypothesis_without_numbers_leaves_the_whole_range():
    slope = np.array([[np.inf, -np.inf, np.nan, 1.0, 1.0]], np.float32)
    sigma = np.array([[0.5, 0.5, np.nan, np.nan, np.inf]], np.float32)
    window = window_of((1, 5), (-6.0, 4.0), SlopePrior(slope, sigma))
    assert (window.low_px == -6).all()
    assert (window.high_px == 4).all()
    assert window.expected_px.tolist() == [[-1, -1, -1, 1, 1]]


def test_a_hypothesis_may_be_a_part_of_a_larger_map():
    slope = np.arange(24, dtype=np.float32).reshape(4, 6)[1:3, 1::2]
    window = window_of((2, 3), (-60.0, 60.0), SlopePrior(slope, np.full_like(slope, 0.5)))
    assert window.low_px.tolist() == (slope - 1).tolist()
    assert window.high_px.tolist() == (slope + 1).tolist()


@pytest.mark.parametrize("range_px", [(1.0, 1.0), (2.0, 1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_an_empty_range_is_told(range_px: tuple[float, float]):
    with pytest.raises(SlopeError, match="asked to search slopes from"):
        window_of((2, 2), range_px, None)


def test_a_prior_must_fit_the_views_and_have_sigmas():
    good = filled(0.0, (2, 3))
    for bad in (SlopePrior(filled(0.0, (3, 2)), good), SlopePrior(good, filled(0.0, (3, 2)))):
        with pytest.raises(SlopeError, match="the prior has slopes"):
            window_of((2, 3), (-1.0, 1.0), bad)
    with pytest.raises(SlopeError, match="negative sigma"):
        window_of((2, 3), (-1.0, 1.0), SlopePrior(good, good - 1))
    assert window_of((2, 3), (-1.0, 1.0), SlopePrior(good, good)).widest_px() == 0.0


@pytest.mark.parametrize(
    ("wide", "width_px", "effort"),
    [
        (0, 1.0, Effort.FOLLOWED),
        (59, 1.7, Effort.FOLLOWED),  # of 1200, not yet a twentieth
        (60, 1.7, Effort.FULL),
        (1200, 1.5, Effort.FOLLOWED),  # eight labels of 0.2 px are narrow
        (1200, 1.7, Effort.FULL),
        (1200, 19.1, Effort.FULL),
        (1200, 19.3, Effort.COARSE),  # 96 labels are 19.2 px
    ],
)
def test_the_effort_follows_the_width_of_the_windows(wide: int, width_px: float, effort: Effort):
    high = filled(0.5)
    high.ravel()[:wide] = width_px
    window = Window(filled(0.0), high, filled(0.0))
    assert effort_of(CROSS, window) is effort
    expected = wide / 1200 if width_px > 1.6 else 0.0
    assert wide_share(window, CROSS) == pytest.approx(expected)


def test_what_was_found_counts_only_where_it_was_looked_for():
    wide = np.array([[True, False]])
    twice = np.array([[True, True]])
    found = Found(filled(2.0, (1, 2)), filled(3.0, (1, 2)), twice, filled(4.0, (1, 2)))
    kept = found.only(wide, filled(-1.0, (1, 2)))
    assert kept.slope_px.tolist() == [[2.0, -1.0]]
    assert kept.rival_px[0, 0] == 3.0
    assert np.isnan(kept.rival_px[0, 1])
    assert kept.unshared.tolist() == [[True, False]]
    assert kept.apart_px.tolist() == [[4.0, 0.0]]
    alone = Found.alone(filled(2.0, (1, 2)))
    assert np.isnan(alone.rival_px).all()
    assert not alone.unshared.any()
    assert not alone.apart_px.any()


GREY = np.array([[10.0, 10.0, 40.0], [10.0, 25.0, 40.0]], np.float32)


@pytest.mark.parametrize(("labels", "high"), [(20, 24.0), (40, 24.0), (41, 24.4), (100, 48.0)])
def test_jumps_cost_less_at_edges_and_more_among_many_labels(labels: int, high: float):
    scales = Scales(noise=3.0, texture=6.0)  # alike up to 15 grey levels
    across, down = jump_penalties(GREY, scales, labels)

    def cost(edge: float) -> int:
        return int(8 + (high - 8) * np.exp(-edge / 15.0))

    assert across.tolist() == [[cost(0), cost(0), cost(30)], [cost(0), cost(15), cost(15)]]
    assert down.tolist() == [[cost(0)] * 3, [cost(0), cost(15), cost(0)]]


def test_fading_penalties_are_scaled_by_what_most_neighbours_differ_by():
    across, down = fading_penalties(GREY, (20.0, 120.0))
    scale = 4.0 * 0.5 * (60 / 6 + 15 / 6)

    def cost(edge: float) -> int:
        return int(20 + 100 * np.exp(-edge / scale))

    assert across.tolist() == [[cost(0), cost(0), cost(30)], [cost(0), cost(15), cost(15)]]
    assert down.tolist() == [[cost(0)] * 3, [cost(0), cost(15), cost(0)]]


def test_texture_is_raised_along_the_line_of_each_view():
    images = RNG.uniform(0, 100, (5, 12, 14)).astype(np.float32)
    raised, centres = raise_texture(images, CROSS)
    wide = np.pad(images.astype(float), ((0, 0), (1, 1), (1, 1)), mode="edge")
    along = 0.5 * (wide[:, 1:-1, 2:] - wide[:, 1:-1, :-2]) + 0.15 * images
    down = 0.5 * (wide[:, 2:, 1:-1] - wide[:, :-2, 1:-1]) + 0.15 * images
    assert raised[:3] == pytest.approx(along[:3], rel=1e-4, abs=1e-3)
    assert raised[3:] == pytest.approx(down[3:], rel=1e-4, abs=1e-3)
    assert centres[0] == pytest.approx(along[0], rel=1e-4, abs=1e-3)
    assert centres[1] == pytest.approx(down[0], rel=1e-4, abs=1e-3)
    edge = np.pad(centres.astype(float), ((0, 0), (1, 1), (1, 1)), mode="reflect")
    rough = (
        edge[:, 1:-1, 2:] + edge[:, 1:-1, :-2] + edge[:, 2:, 1:-1] + edge[:, :-2, 1:-1]
        - 4 * centres
    )  # fmt: skip
    assert texture_levels(centres) == pytest.approx(float(np.sqrt((rough**2).mean())), rel=1e-4)


def plain_hidden(slope: Map, x: float, y: float, jump: float, margin: int) -> NDArray[np.bool_]:
    height, width = slope.shape

    def place(v: int, u: int) -> tuple[int, int] | None:
        a, b = u - slope[v, u] * x + 0.5, v - slope[v, u] * y + 0.5
        return (int(b), int(a)) if 0 < a < width and 0 < b < height else None

    nearest = np.full(slope.shape, -np.inf)
    for v, u in np.ndindex(slope.shape):
        at = place(v, u)
        if at is not None:
            nearest[at] = max(nearest[at], slope[v, u])
    across, down = (margin if x else 0), (margin if y else 0)
    hidden = np.zeros(slope.shape, np.bool_)
    for v, u in np.ndindex(slope.shape):
        at = place(v, u)
        if at is not None:
            rows = slice(max(at[0] - down, 0), at[0] + down + 1)
            columns = slice(max(at[1] - across, 0), at[1] + across + 1)
            hidden[v, u] = nearest[rows, columns].max() > slope[v, u] + jump
    return hidden


@pytest.mark.parametrize("margin", [0, 1, 2])
def test_hidden_points_are_those_behind_a_nearer_one_at_their_place(margin: int):
    slope = RNG.choice([-1.25, 0.0, 0.5, 3.25], (14, 17)).astype(np.float32)
    x, y = np.array([0.0, 1.0, -2.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.0, -1.0, 1.0])
    covered, hidden = hidden_points(slope, x, y, 0.6, margin)
    each = [plain_hidden(slope, x[i], y[i], 0.6, margin) for i in range(1, 5)]
    assert not covered[0].any()
    for found, expected in zip(covered[1:], each, strict=True):
        assert np.array_equal(found, expected)
    half = assign_halves(x, y)
    ends = [
        max(np.flatnonzero(half == h), key=lambda i: np.hypot(x[i], y[i])) for h in set(half[1:])
    ]
    exact = np.logical_or.reduce([plain_hidden(slope, x[i], y[i], 0.6, 0) for i in ends])
    assert np.array_equal(hidden, exact)
    assert 0.02 < hidden.mean() < 0.9


@pytest.mark.parametrize("width", [16, 17])
def test_every_second_hidden_point_is_as_in_the_whole_picture(width: int):
    slope = RNG.choice([-1.25, 0.0, 0.5, 3.25], (61, width)).astype(np.float32)
    x, y = np.array([0.0, 1.0, -2.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.0, -1.0, 1.0])
    covered, hidden = hidden_points(slope, x, y, 0.6, 2)
    thin_covered, thin_hidden = hidden_points(slope, x, y, 0.6, 2, is_thin=True)
    assert np.array_equal(thin_covered, np.stack([thinned(one) for one in covered]))
    assert np.array_equal(thin_hidden, thinned(hidden))


def ready(cameras: Cameras, *, is_one_sided: bool) -> Any:
    return SimpleNamespace(cameras=cameras, is_one_sided=is_one_sided)


def test_stitching_moves_a_pair_by_one_step_at_most():
    slope, stitched = filled(1.0, (1, 3)), np.array([[1.19, 1.21, 0.79]], np.float32)
    many = estimate._within_reach(slope, stitched, ready(CROSS, is_one_sided=False))
    assert many is stitched
    pair = estimate._within_reach(slope, stitched, ready(PAIR, is_one_sided=True))
    assert pair[0] == pytest.approx([1.19, 1.0, 1.0])


def lines(misfit: Map) -> LineFits:
    one = filled(1.0)
    return LineFits(one, one, one, misfit, one, one, np.full(SHAPE, SEEN, np.uint8))


@pytest.mark.parametrize(("columns", "is_misled"), [(19, False), (23, True)])
def test_a_hypothesis_is_wrong_where_half_of_what_it_knew_is_contradicted(
    columns: int, is_misled: bool
):
    misfit = filled(0.0)
    misfit[:, :columns] = 3.0
    sure = Window(filled(0.0), filled(1.5), filled(0.0))
    against = contradicted(lines(misfit))
    assert estimate._is_misled(against, sure, CROSS, is_thin=False) is is_misled
    # Windows wider than eight labels were no knowledge.
    unsure = Window(filled(0.0), filled(1.7), filled(0.0))
    assert not estimate._is_misled(against, unsure, CROSS, is_thin=False)


def test_what_is_unknown_of_the_places_widens_sigma_up_to_that_of_a_guess():
    found = SlopeMap(
        filled(2.0, (1, 2)),
        np.array([[0.3, 3.0]], np.float32),
        np.full((1, 2), Label.NEARER, np.uint8),
    )
    none = np.zeros((2, 2))
    places = Placement(
        none, none, np.zeros(2), np.zeros(2), np.zeros(2, np.bool_), np.array([0.08, 0.0, 0.02])
    )
    assert estimate._with_doubt_of(None, found, 9.0) is found
    doubted = estimate._with_doubt_of(places, found, 9.0)
    assert doubted.sigma_px[0] == pytest.approx([0.5, 9 / 12**0.5])
    assert doubted.slope_px is found.slope_px


def test_cameras_move_by_the_steps_that_were_found():
    steps = np.array([[0.0, 0.0], [0.1, -0.2]])
    places = Placement(
        np.zeros((2, 2)), steps, np.zeros(2), np.zeros(2), np.zeros(2, np.bool_), np.zeros(3)
    )
    moved = estimate._moved(PAIR, places)
    assert moved.x_steps == pytest.approx([0.0, 2.1])
    assert moved.y_steps == pytest.approx([0.0, -0.2])
    assert moved.reference == 0


def test_luminance_is_the_mean_of_the_channels():
    colour = RNG.integers(0, 255, (2, 4, 5, 3)).astype(np.uint8)
    assert luminance(colour) == pytest.approx(colour.astype(float).mean(axis=-1))
