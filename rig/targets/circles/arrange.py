"""Which blob is which circle: blobs are walked along the diagonals of the grid.

Circles of neighbouring rows make a square lattice that stands on its corner. In steps of its two
diagonals, u = (x + y) / 2 and v = (x - y) / 2 of places (x, y), every circle has whole numbers.
"""

from collections.abc import Iterator
from itertools import permutations

import numpy as np

from rig.arrays import Float, Index
from rig.targets.circles.grid import CircleGrid

_SEEDS = 6
"""Blobs from which the walk is begun, in turn."""
_NEIGHBOURS = 8
"""Of a seed, between which the two diagonals are sought."""
_LOOSE = 0.3
"""How far a blob may lie from where the last step puts it, in that step."""
_MOST_RATIO = 2.5
"""Of the lengths of the two diagonals."""

_Placed = dict[tuple[int, int], int]


def arrange(blobs_px: Float, grid: CircleGrid) -> tuple[Index | None, int]:
    """Tell which blob is which circle.

    Of two ways that a grid with an even number of rows leaves, circle 0 is the one nearer to the
    top left of the picture.

    Args:
        blobs_px: (B, 2).
        grid: what they may be; all of it is wanted.

    Returns:
        (rows * columns,) numbers of the blobs, None where no arrangement holds all circles; and
        the most circles that any arrangement holds.
    """
    most = 0
    count = grid.rows * grid.columns
    for seed in _seeds(blobs_px):
        for first, second in _diagonals(blobs_px, seed):
            placed = _walk(blobs_px, seed, first, second)
            if len(placed) <= most and len(placed) < count:
                continue
            ways, held = _fitting(placed, grid)
            most = max(most, held)
            if ways:
                return min(ways, key=lambda way: float(blobs_px[way[0]].sum())), count
    return None, most


def _seeds(blobs_px: Float) -> list[int]:
    """Blobs nearest to the middle of all: those have neighbours on all sides."""
    if len(blobs_px) < _NEIGHBOURS + 1:
        return []
    apart = np.linalg.norm(blobs_px - np.median(blobs_px, axis=0), axis=1)
    return np.argsort(apart, kind="stable")[:_SEEDS].tolist()


def _diagonals(blobs_px: Float, seed: int) -> Iterator[tuple[Float, Float]]:
    """Pairs of steps from a seed to its neighbours that may be the two diagonals, short ones first.

    The second one lies to the left of the first, as u and v do on the grid.
    """
    apart = blobs_px - blobs_px[seed]
    near = np.argsort(np.linalg.norm(apart, axis=1), kind="stable")[1 : _NEIGHBOURS + 1]
    steps = apart[near]
    length = np.linalg.norm(steps, axis=1)
    pairs = [
        (length[i] + length[j], i, j)
        for i, j in permutations(range(len(steps)), 2)
        if steps[i, 0] * steps[j, 1] - steps[i, 1] * steps[j, 0] < -0.2 * length[i] * length[j]
        and max(length[i], length[j]) < _MOST_RATIO * min(length[i], length[j])
    ]
    # Quarter turns of a pair are tried with the arrangement, not here.
    for _, i, j in sorted(pairs):
        if steps[i, 0] > 0 and steps[i, 0] >= abs(steps[j, 0]) - 1e-9:
            yield steps[i], steps[j]


def _walk(blobs_px: Float, seed: int, first: Float, second: Float) -> _Placed:
    """Blobs by their whole numbers (u, v), from a seed at (0, 0)."""
    placed: _Placed = {(0, 0): seed}
    free = np.ones(len(blobs_px), np.bool_)
    free[seed] = False
    queue = [(0, 0, seed, first, second)]
    for u, v, here, along_u, along_v in queue:
        for du, dv in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if (u + du, v + dv) in placed:
                continue
            step = du * along_u + dv * along_v
            apart = np.linalg.norm(blobs_px - (blobs_px[here] + step), axis=1)
            apart[~free] = np.inf
            other = int(apart.argmin())
            if apart[other] > _LOOSE * np.linalg.norm(step):
                continue
            placed[u + du, v + dv] = other
            free[other] = False
            taken = blobs_px[other] - blobs_px[here]
            own_u = du * taken if du else along_u
            own_v = dv * taken if dv else along_v
            queue.append((u + du, v + dv, other, own_u, own_v))
    return placed


def _fitting(placed: _Placed, grid: CircleGrid) -> tuple[list[Index], int]:
    """Arrangements that hold all circles, and the most circles that any holds."""
    x, y = grid.places.reshape(-1, 2).T
    wanted = np.stack([(x + y) // 2, (x - y) // 2], axis=1)
    at = np.array(list(placed))
    numbers = np.array(list(placed.values()), np.intp)
    ways: list[Index] = []
    most = 0
    for quarter in range(4):
        turned = at @ np.linalg.matrix_power(np.array([[0, 1], [-1, 0]]), quarter)
        turned = turned - turned.min(axis=0)
        room = turned.max(axis=0) + 1
        index = np.full(room, -1, np.intp)
        index[turned[:, 0], turned[:, 1]] = numbers
        spread = wanted - wanted.min(axis=0)
        free = room - spread.max(axis=0) - 1
        padded = np.pad(index, [(int(max(-n, 0)), int(max(-n, 0))) for n in free], "constant",
                        constant_values=-1)  # fmt: skip
        for shift in np.ndindex(*(np.array(padded.shape) - spread.max(axis=0))):
            held = padded[spread[:, 0] + shift[0], spread[:, 1] + shift[1]]
            most = max(most, int((held >= 0).sum()))
            if (held >= 0).all():
                ways.append(held)
    return ways, most
