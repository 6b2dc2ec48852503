import numpy as np

from rig.epipolar.search.aggregate import aggregate, winners
from rig.epipolar.search.halves import COST_MAX, assign_halves
from rig.epipolar.search.narrow import narrow_costs
from rig.epipolar.search.plane_sweep import sweep_costs

RNG = np.random.default_rng(5)
WIDE = RNG.uniform(0, 200, (24, 80)).astype(np.float32)


def shifted_views(slope: int) -> np.ndarray:
    """Three views in a row of one plane, exact whole-pixel shifts."""
    return np.stack([WIDE[:, 20 + slope * x : 60 + slope * x] for x in (-1, 0, 1)])


X_STEPS, Y_STEPS = np.array([-1.0, 0.0, 1.0]), np.zeros(3)


def test_views_join_the_half_of_their_direction() -> None:
    x = np.array([0.0, -1.0, 2.0, 0.1, 0.0, 1.0])
    y = np.array([0.0, 0.2, 0.0, -1.0, 3.0, 1.0])
    assert assign_halves(x, y).tolist() == [-1, 0, 1, 2, 3, 1]


def test_row_and_column_of_a_corner_are_each_others_spare_half() -> None:
    x, y = np.array([0.0, 1.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0, 1.0])
    assert assign_halves(x, y).tolist() == [-1, 1, 0, 1]
    assert assign_halves(-x, y).tolist() == [-1, 0, 1, 0]


def test_the_right_label_costs_nothing_and_wins() -> None:
    labels = np.arange(-4, 5).astype(np.float32)
    views = np.ascontiguousarray(shifted_views(3))
    costs = sweep_costs(views, X_STEPS, Y_STEPS, 1, labels, 20.0)
    assert costs[:, 7].max() == 0
    assert np.median(costs[:, 2]) > 0.5 * COST_MAX
    bound = np.full(views.shape[1:], 4.0, np.float32)
    jumps = np.full(views.shape[1:], 24, np.int16)
    slope = winners(aggregate(costs, jumps, jumps, 6), labels, -bound, bound)
    assert np.median(np.abs(slope - 3.0)) < 0.05
    assert np.abs(slope - 3.0).max() < 0.5


def test_a_hidden_half_does_not_raise_the_cost_much() -> None:
    views = np.ascontiguousarray(shifted_views(3))
    views[0] = RNG.uniform(0, 200, views[0].shape)
    costs = sweep_costs(views, X_STEPS, Y_STEPS, 1, np.array([3.0], np.float32), 20.0)
    inner = costs[:, 0, 6:-6]
    assert inner.max() < 0.05 * COST_MAX


def test_the_narrow_search_costs_what_the_sweep_costs_at_the_same_slope() -> None:
    views = np.ascontiguousarray(shifted_views(2))
    wide = sweep_costs(views, X_STEPS, Y_STEPS, 1, np.array([1.0, 2.0, 3.0], np.float32), 20.0)
    offsets = np.array([-1.0, 0.0, 1.0], np.float32)
    centre = np.full(views.shape[1:], 2.0, np.float32)
    narrow = narrow_costs(views, X_STEPS, Y_STEPS, 1, centre, offsets, 20.0)
    assert np.abs(wide.astype(int) - narrow.astype(int)).max() <= 1


def test_winners_stay_inside_the_window() -> None:
    labels = np.arange(-4, 5).astype(np.float32)
    views = np.ascontiguousarray(shifted_views(3))
    costs = sweep_costs(views, X_STEPS, Y_STEPS, 1, labels, 20.0)
    jumps = np.full(views.shape[1:], 24, np.int16)
    total = aggregate(costs, jumps, jumps, 6)
    low = np.full(views.shape[1:], -1.0, np.float32)
    slope = winners(total, labels, low, low + 2)
    assert slope.min() >= -1.5
    assert slope.max() <= 1.5


def test_aggregation_fills_what_says_nothing_from_its_surroundings() -> None:
    costs = np.full((9, 5, 9), 100, np.uint8)
    costs[:, 1] = 0
    costs[3:6, :, 3:6] = 100
    jumps = np.full((9, 9), 24, np.int16)
    total = aggregate(costs, jumps, jumps, 6)
    assert np.all(total.argmin(axis=1) == 1)
