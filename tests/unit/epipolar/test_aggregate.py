"""Path costs, winners and rivals beside the equations of the method, written out per pixel."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.epipolar.search.aggregate import aggregate, rivals, winners

Costs = NDArray[np.int64]


def one_path(costs: Costs, jump: Costs, step: int, *, is_forward: bool) -> Costs:
    """L(p, d) along the first axis of costs (N, L, P); jump (N, P) lies before each pixel."""
    count, labels, _ = costs.shape
    order = range(count) if is_forward else range(count - 1, -1, -1)
    result = np.zeros_like(costs)
    last: Costs | None = None
    for k in order:
        edge = jump[k] if is_forward else jump[min(k + 1, count - 1)]
        for d in range(labels):
            if last is None:
                # No pixel came before: its costs count as 0, of all labels.
                result[k, d] = costs[k, d]
                continue
            lowest = last.min(axis=0)
            ways = [last[d], lowest + edge]
            ways += [last[e] + step for e in (d - 1, d + 1) if 0 <= e < labels]
            result[k, d] = costs[k, d] + np.min(ways, axis=0) - lowest
        last = result[k]
    return result


def four_paths(costs: Costs, jump_x: Costs, jump_y: Costs, step: int) -> Costs:
    turned = np.transpose(costs, (2, 1, 0))
    rows = sum(one_path(turned, jump_x.T, step, is_forward=way) for way in (True, False))
    columns = sum(one_path(costs, jump_y, step, is_forward=way) for way in (True, False))
    return np.transpose(np.asarray(rows), (2, 1, 0)) + np.asarray(columns)


# The last is taller than two bands of the rows that are turned at a time.
@pytest.mark.parametrize("shape", [(2, 3, 2), (5, 4, 7), (2, 6, 9), (531, 3, 2)])
def test_summed_costs_are_those_of_the_four_paths(shape: tuple[int, int, int]):
    rng = np.random.default_rng(shape[0])
    costs = rng.integers(0, 241, shape)
    jump_x, jump_y = rng.integers(5, 90, (2, shape[0], shape[2]))
    found = aggregate(costs.astype(np.uint8), jump_x.astype(np.int16), jump_y.astype(np.int16), 7)
    assert np.array_equal(found, four_paths(costs, jump_x, jump_y, 7))


LABELS_PX = np.array([-2.0, -1.5, -1.0, -0.5, 0.0, 0.5], np.float32)
STEP_PX = 0.5


def plain_winner(cost: Costs, low_px: float, high_px: float) -> float:
    low, high = (low_px - LABELS_PX[0]) / STEP_PX, (high_px - LABELS_PX[0]) / STEP_PX
    middle = round(0.5 * (low + high))
    last = len(cost) - 1
    first = min(max(min(np.ceil(low - 1e-3), middle), 0), last)
    final = min(max(np.floor(high + 1e-3), middle, 0), last)
    taken = [k for k in range(len(cost)) if first <= k <= final]
    best = min(taken, key=lambda k: (cost[k], k))
    found = float(LABELS_PX[best])
    if 0 < best < last:
        below, above = cost[best - 1] - cost[best], cost[best + 1] - cost[best]
        if min(below, above) >= 0 and max(below, above) > 0:
            found += 0.5 * STEP_PX * (below - above) / max(below, above)
    return found


def windows(shape: tuple[int, int], seed: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Some wide, some on labels, some between two, some beyond all of them."""
    rng = np.random.default_rng(seed)
    low = rng.choice([-9.0, -2.0, -1.3, -1.0, -0.6, 0.1, 0.5], shape).astype(np.float32)
    return low, (low + rng.choice([0.0, 0.3, 0.5, 1.0, 12.0], shape)).astype(np.float32)


def test_winners_are_the_lowest_labels_of_their_windows_refined():
    rng = np.random.default_rng(2)
    total = rng.integers(0, 12, (9, len(LABELS_PX), 31)).astype(np.int16)
    low, high = windows((9, 31), 3)
    found = winners(total, LABELS_PX, low, high)
    expected = [
        [plain_winner(total[v, :, u].astype(int), low[v, u], high[v, u]) for u in range(31)]
        for v in range(9)
    ]
    assert np.allclose(found, expected, atol=1e-6)


def test_equal_costs_take_the_lowest_label_and_no_refinement():
    total = np.full((1, 6, 1), 4, np.int16)
    bounds = np.array([[-1.5]], np.float32), np.array([[0.5]], np.float32)
    assert winners(total, LABELS_PX, *bounds).item() == -1.5


def test_rivals_are_the_lowest_labels_that_are_not_within_three_of_the_winner():
    rng = np.random.default_rng(4)
    labels_px = np.linspace(-3.0, 2.0, 11).astype(np.float32)
    total = rng.integers(0, 9, (7, 11, 13)).astype(np.int16)
    won = rng.integers(0, 11, (7, 13))
    slope = labels_px[won] + rng.uniform(-0.2, 0.2, won.shape).astype(np.float32)
    found = rivals(total, labels_px, slope)
    for v, u in np.ndindex(won.shape):
        others = [k for k in range(11) if abs(k - won[v, u]) > 3]
        best = min(others, key=lambda k: (total[v, k, u], k))
        assert found[v, u] == labels_px[best]


def test_few_labels_leave_no_rival():
    labels_px = np.arange(4, dtype=np.float32)
    found = rivals(np.ones((1, 4, 1), np.int16), labels_px, np.zeros((1, 1), np.float32))
    assert np.isnan(found).all()
