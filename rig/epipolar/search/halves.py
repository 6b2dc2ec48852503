"""Half costs: the views left, right, above and below the reference vote separately.

At an occlusion one half of an axis still sees the point: Kang, Szeliski and Chai, "Handling
occlusions in dense multi-view stereo" (CVPR 2001).
"""

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel

HALVES = 4
LEFT, RIGHT, ABOVE, BELOW = range(HALVES)
"""Index of each half; two of one axis follow each other."""
COST_MAX = 240
_UNSEEN = np.float32(1e12)
NO_VIEWS = np.float32(3) * _UNSEEN
"""What `mean_of_three` would say of a half without views."""
# Share of the truncation by which the worse half may raise the cost of its axis: enough to settle
# ties, too little to let a hidden half spoil the vote.
_EXCESS = np.float32(0.03)


def assign_halves(x_steps: NDArray[np.float64], y_steps: NDArray[np.float64]) -> NDArray[np.int32]:
    """Half of each view, (V,): `LEFT`, `RIGHT`, `ABOVE`, `BELOW`, -1 at the reference itself.

    A view off both axes joins the half whose direction is nearest. Where the reference is a corner
    of its array, no axis has two halves; then its row and its column are each other's spare half.
    """
    along_row = is_beside(x_steps, y_steps)
    half = np.where(
        along_row, np.where(x_steps < 0, LEFT, RIGHT), np.where(y_steps < 0, ABOVE, BELOW)
    )
    half[np.hypot(x_steps, y_steps) < 1e-6] = -1
    sides = set(half[half >= 0].tolist())
    if len(sides) == 2 and min(sides) < ABOVE <= max(sides):
        half[half >= ABOVE] = RIGHT - min(sides)
    return half.astype(np.int32)


def is_beside(x_steps: NDArray[np.float64], y_steps: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each view lies rather beside the reference than above or below it, (V,)."""
    return np.abs(x_steps) >= np.abs(y_steps)


@kernel()
def shares_of(counts: NDArray[np.float32], unseen: NDArray[np.float32]) -> None:
    """Turn how many views of each half (4, W) see a pixel into the share of each.

    Fills `unseen` (4, W): the cost of a half that does not see it, 0 where it does.
    """
    for h in range(HALVES):
        count, none = counts[h], unseen[h]
        for u in range(len(count)):
            none[u] = np.float32(0) if count[u] > 0 else _UNSEEN
            count[u] = np.float32(1) / max(count[u], np.float32(1))


@kernel()
def mean_of_three(
    sums: NDArray[np.float32],
    shares: NDArray[np.float32],
    unseen: NDArray[np.float32],
    has_views: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> None:
    """Mean difference of each half (4, W) from sums and `shares_of`, added over three columns.

    Halves without views are left as they are: `NO_VIEWS`.
    """
    width = sums.shape[1]
    for h in range(HALVES):
        if not has_views[h]:
            continue
        total, share, none, row = sums[h], shares[h], unseen[h], out[h]
        for u in range(width):
            total[u] = total[u] * share[u] + none[u]
        inner, left, right = row[1 : width - 1], total[: width - 2], total[2:]
        middle = total[1 : width - 1]
        for u in range(width - 2):
            inner[u] = left[u] + middle[u] + right[u]
        row[0] = np.float32(2) * total[0] + total[1]
        row[width - 1] = np.float32(2) * total[width - 1] + total[width - 2]


@kernel()
def join_halves(
    above: NDArray[np.float32],
    here: NDArray[np.float32],
    below: NDArray[np.float32],
    truncation: np.float32,
    out: NDArray[np.uint8],
) -> None:
    """Per axis the better half, raised a little by the worse one; then the sum of both axes.

    The inputs are sums over three columns, of three rows: 9 pixels, of at most `truncation` each.
    An axis that no view sees takes the cost of the other.
    """
    width = len(out)
    full = np.float32(9) * truncation
    limit = _EXCESS * full
    scale = np.float32(COST_MAX) / (np.float32(2) * full)
    for u in range(width):
        left = above[LEFT, u] + here[LEFT, u] + below[LEFT, u]
        right = above[RIGHT, u] + here[RIGHT, u] + below[RIGHT, u]
        up = above[ABOVE, u] + here[ABOVE, u] + below[ABOVE, u]
        down = above[BELOW, u] + here[BELOW, u] + below[BELOW, u]
        row = _axis_cost(left, right, full, limit)
        column = _axis_cost(up, down, full, limit)
        if row >= _UNSEEN:
            row = column
        if column >= _UNSEEN:
            column = row
        cost = scale * (row + column)
        out[u] = np.uint8(cost if cost < COST_MAX else np.float32(COST_MAX))


@kernel()
def _axis_cost(
    one: np.float32, other: np.float32, full: np.float32, limit: np.float32
) -> np.float32:
    """The better half, raised by half of the gap to the worse one, at most by `limit`."""
    low = min(other, one)
    gap = np.float32(0.5) * abs(one - other)
    if gap > full:  # one half is unseen
        return low
    return low + min(limit, gap)
