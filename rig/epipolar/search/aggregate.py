"""Semi-global aggregation of a cost volume along four paths, and the winning slope.

H. Hirschmuller, "Stereo processing by semiglobal matching and mutual information", IEEE TPAMI
30(2), 2008; the penalty for a jump falls where the reference view has an edge.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel

_LARGE = np.int16(8000)
_BESIDE_LABELS = 3
"""Labels beside the winner that are no slope of their own."""
_ROWS = 256
"""Rows that are turned at a time: enough for long loops, few enough not to fill the memory."""


def aggregate(
    costs: NDArray[np.uint8], jump_x: NDArray[np.int16], jump_y: NDArray[np.int16], step: int
) -> NDArray[np.int16]:
    """Sum of the path costs from the left, the right, above and below.

    Args:
        costs: (H, L, W).
        jump_x: (H, W) penalty of a jump between a pixel and its left neighbour.
        jump_y: (H, W) penalty of a jump between a pixel and the one above.
        step: penalty of a change by one label.

    Returns:
        (H, L, W) summed path costs.
    """
    total = np.empty(costs.shape, np.int16)
    run_in_bands(
        lambda a, b: _along_rows(costs, jump_x, np.int16(step), a, b, total), costs.shape[0]
    )
    run_in_bands(
        lambda a, b: _along_columns(costs, jump_y, np.int16(step), a, b, total), costs.shape[2]
    )
    return total


def add_diagonals(
    costs: NDArray[np.uint8],
    jump_x: NDArray[np.int16],
    jump_y: NDArray[np.int16],
    step: int,
    total: NDArray[np.int16],
) -> None:
    """Add to summed path costs those of the four diagonal paths.

    Args:
        costs: as `aggregate` takes them.
        jump_x: see there.
        jump_y: see there.
        step: see there.
        total: (H, L, W) what `aggregate` gives.
    """
    jump = np.minimum(jump_x, jump_y)
    height, labels, width = costs.shape
    path = np.empty((2, 2, 2, labels + 2, width + 2), np.int16)
    path[:] = _LARGE
    path[:, :, :, 1 : labels + 1] = np.int16(0)
    lowest = np.zeros((2, 2, 2, width + 2), np.int16)

    def walk(first: int, last: int, start: int, stop: int) -> None:
        for direction in range(start, stop):
            _along_diagonals(
                costs, jump, np.int16(step), direction, first, last, path[direction],
                lowest[direction], total,
            )  # fmt: skip

    # Paths down and paths up add to one sum: they meet in the middle row, which is done by one.
    half = height // 2
    run_in_bands(lambda start, stop: walk(0, half, start, stop), 2)
    walk(half, height - half, 0, 2)
    run_in_bands(lambda start, stop: walk(height - half, height, start, stop), 2)


@kernel()
def _along_diagonals(
    costs: NDArray[np.uint8],
    jump: NDArray[np.int16],
    step: np.int16,
    direction: int,
    first: int,
    last: int,
    path: NDArray[np.int16],
    lowest: NDArray[np.int16],
    total: NDArray[np.int16],
) -> None:
    """Add rows `first` to `last` of both diagonal paths that run down (direction 0) or up (1).

    `path` and `lowest` bear what the row before has left; it is read one column to the left
    (side 0) or to the right (side 1). See `_along_columns`.
    """
    height, labels, width = costs.shape
    for k in range(first, last):
        v = k if direction == 0 else height - 1 - k
        edge = jump[v if direction == 0 else min(v + 1, height - 1)]
        for side in range(2):
            came = 0 if side == 0 else 2
            before, after = path[k % 2, side], path[(k + 1) % 2, side]
            old = lowest[k % 2, side, came : came + width]
            new = lowest[(k + 1) % 2, side, 1 : 1 + width]
            new[:] = _LARGE
            for label in range(labels):
                cost = costs[v, label]
                down = before[label, came : came + width]
                middle = before[label + 1, came : came + width]
                up = before[label + 2, came : came + width]
                target = after[label + 1, 1 : 1 + width]
                summed = total[v, label]
                for u in range(width):
                    near = min(up[u], down[u])
                    near = np.int16(near + step)
                    far = np.int16(old[u] + edge[u])
                    best = min(near, middle[u])
                    best = min(far, best)
                    value = np.int16(np.int16(np.int16(cost[u]) + best) - old[u])
                    target[u] = value
                    new[u] = min(new[u], value)
                    summed[u] = np.int16(summed[u] + value)


def _along_rows(
    costs: NDArray[np.uint8],
    jump: NDArray[np.int16],
    step: np.int16,
    start: int,
    stop: int,
    total: NDArray[np.int16],
) -> None:
    """Fill rows of `total`, by way of columns: paths side by side vectorise, labels hardly do."""
    _, labels, width = costs.shape
    count = min(_ROWS, stop - start)
    cost = np.empty((width, labels, count), np.uint8)
    path_sum = np.empty((width, labels, count), np.int16)
    for next_first in range(start, stop, count):
        first = min(next_first, stop - count)  # the last rows overlap those before
        rows = slice(first, first + count)
        for label in range(labels):
            cv2.transpose(costs[rows, label], dst=cost[:, label])
        edge = np.ascontiguousarray(jump[rows].T)
        path_sum[:] = 0
        _along_columns(cost, edge, step, 0, count, path_sum)
        for label in range(labels):
            cv2.transpose(path_sum[:, label], dst=total[rows, label])


@kernel()
def _along_columns(
    costs: NDArray[np.uint8],
    jump: NDArray[np.int16],
    step: np.int16,
    start: int,
    stop: int,
    total: NDArray[np.int16],
) -> None:
    """Add the paths along columns `start` to `stop`, both ways.

    L(p, d) = C(p, d) - m + min(L(q, d), L(q, d - 1) + step, L(q, d + 1) + step, m + jump) with the
    cost C, the pixel q before p on the path, and m the lowest L(q). Of `path` and `lowest` one half
    is read, the other written; the first and last row of a path are large, so that no label needs
    a border check.
    """
    height, labels, _ = costs.shape
    width = stop - start
    path = np.empty((2, labels + 2, width), np.int16)
    lowest = np.empty((2, width), np.int16)
    for direction in range(2):
        path[:] = _LARGE
        path[0, 1 : labels + 1] = np.int16(0)
        lowest[0] = np.int16(0)
        for k in range(height):
            v = k if direction == 0 else height - 1 - k
            edge = jump[v if direction == 0 else min(v + 1, height - 1), start:stop]
            before, after = path[k % 2], path[(k + 1) % 2]
            old, new = lowest[k % 2], lowest[(k + 1) % 2]
            new[:] = _LARGE
            for label in range(labels):
                cost = costs[v, label, start:stop]
                down, middle, up = before[label], before[label + 1], before[label + 2]
                target = after[label + 1]
                summed = total[v, label, start:stop]
                for u in range(width):
                    near = min(up[u], down[u])
                    near = np.int16(near + step)
                    far = np.int16(old[u] + edge[u])
                    best = min(near, middle[u])
                    best = min(far, best)
                    value = np.int16(np.int16(np.int16(cost[u]) + best) - old[u])
                    target[u] = value
                    new[u] = min(new[u], value)
                    summed[u] = np.int16(summed[u] + value)


def winners(
    total: NDArray[np.int16],
    labels_px: NDArray[np.float32],
    low_px: NDArray[np.float32],
    high_px: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Slope of the lowest summed cost, refined between labels, (H, W).

    Equiangular (two lines of equal and opposite steepness) interpolation suits absolute
    differences: Shimizu and Okutomi, "Sub-pixel estimation error cancellation on area-based
    matching", IJCV 63, 2005.

    Args:
        total: (H, L, W) summed costs.
        labels_px: (L,) evenly spaced slopes.
        low_px: (H, W) lowest slope allowed.
        high_px: (H, W) highest slope allowed; the label nearest to a window that lies between two
            labels always takes part.
    """
    height, labels, width = total.shape
    step = (labels_px[-1] - labels_px[0]) / (labels - 1)
    low, high = ((bound - labels_px[0]) / step for bound in (low_px, high_px))
    middle = np.rint(0.5 * (low + high))
    tolerance = np.float32(1e-3)
    first, last = (
        np.clip(index, 0, labels - 1).astype(np.int16)
        for index in (
            np.minimum(np.ceil(low - tolerance), middle),
            np.maximum(np.floor(high + tolerance), middle),
        )
    )
    slope = np.empty((height, width), np.float32)
    run_in_bands(lambda a, b: _winners(total, labels_px, first, last, a, b, slope), height)
    return slope


@kernel()
def _winners(
    total: NDArray[np.int16],
    labels_px: NDArray[np.float32],
    first: NDArray[np.int16],
    last: NDArray[np.int16],
    start: int,
    stop: int,
    slope: NDArray[np.float32],
) -> None:
    _, labels, width = total.shape
    best = np.empty(width, np.int16)
    index = np.empty(width, np.int16)
    for v in range(start, stop):
        best[:] = np.int16(32767)
        low, high = first[v], last[v]
        for label in range(labels):
            row = total[v, label]
            here = np.int16(label)
            for u in range(width):
                better = (row[u] < best[u]) & (low[u] <= here) & (here <= high[u])
                best[u] = row[u] if better else best[u]
                index[u] = here if better else index[u]
        for u in range(width):
            i = int(index[u])
            slope[v, u] = labels_px[i]
            if 0 < i < labels - 1:
                below = np.float32(total[v, i - 1, u] - best[u])
                above = np.float32(total[v, i + 1, u] - best[u])
                steepest = max(above, below)
                if steepest > 0 and below >= 0 and above >= 0:
                    shift = np.float32(0.5) * (below - above) / steepest
                    slope[v, u] += shift * (labels_px[i + 1] - labels_px[i])


def rivals(
    total: NDArray[np.int16], labels_px: NDArray[np.float32], slope_px: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Slope of the lowest summed cost that is not beside the winner, (H, W).

    Args:
        total: (H, L, W) summed costs.
        labels_px: (L,) evenly spaced slopes.
        slope_px: (H, W) the winners.
    """
    step = (labels_px[-1] - labels_px[0]) / (len(labels_px) - 1)
    winner = np.rint((slope_px - labels_px[0]) / step).astype(np.int16)
    other = np.empty(slope_px.shape, np.float32)
    run_in_bands(lambda a, b: _rivals(total, labels_px, winner, a, b, other), len(total))
    return other


@kernel()
def _rivals(
    total: NDArray[np.int16],
    labels_px: NDArray[np.float32],
    winner: NDArray[np.int16],
    start: int,
    stop: int,
    other: NDArray[np.float32],
) -> None:
    _, labels, width = total.shape
    best = np.empty(width, np.int16)
    index = np.empty(width, np.int16)
    beside = np.int16(_BESIDE_LABELS)
    for v in range(start, stop):
        best[:] = np.int16(32767)
        index[:] = np.int16(-1)
        won = winner[v]
        for label in range(labels):
            row = total[v, label]
            here = np.int16(label)
            for u in range(width):
                better = (row[u] < best[u]) & (abs(np.int16(here - won[u])) > beside)
                best[u] = row[u] if better else best[u]
                index[u] = here if better else index[u]
        for u in range(width):
            other[v, u] = labels_px[index[u]] if index[u] >= 0 else np.float32(np.nan)
