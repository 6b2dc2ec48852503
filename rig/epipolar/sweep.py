"""Half-cost plane sweep: how badly each slope explains each pixel.

Plane sweep after Collins, "A space-sweep approach to true multi-image matching" (CVPR 1996). The
views left, right, above and below the reference vote separately (half costs), after Kang, Szeliski
and Chai, "Handling occlusions in dense multi-view stereo" (CVPR 2001): at an occlusion one half of
an axis still sees the point.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.kernel import kernel

HALVES = 4
COST_MAX = 240
_UNSEEN = np.float32(1e12)
# Share of the truncation by which the worse half may raise the cost of its axis: enough to settle
# ties, too little to let a hidden half spoil the vote.
_EXCESS = np.float32(0.03)


def assign_halves(x_steps: NDArray[np.float64], y_steps: NDArray[np.float64]) -> NDArray[np.int32]:
    """Half of each view, (V,): 0 left, 1 right, 2 above, 3 below, -1 at the reference itself.

    A view off both axes joins the half whose direction is nearest.
    """
    along_row = np.abs(x_steps) >= np.abs(y_steps)
    half = np.where(along_row, np.where(x_steps < 0, 0, 1), np.where(y_steps < 0, 2, 3))
    half[np.hypot(x_steps, y_steps) < 1e-6] = -1
    return half.astype(np.int32)


def sweep_costs(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    labels_px: NDArray[np.float32],
    truncation: float,
) -> NDArray[np.uint8]:
    """Cost of every slope at every pixel.

    Args:
        images: (V, H, W), equalised grey values.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        reference: index of the reference view.
        labels_px: (L,) slopes to try, px per view step.
        truncation: grey difference that counts as a full mismatch.

    Returns:
        (H, L, W) costs, 0 to `COST_MAX`.
    """
    height, width = images.shape[1:]
    costs = np.empty((height, len(labels_px), width), np.uint8)
    half = assign_halves(x_steps, y_steps)
    order = np.argsort(half, kind="stable")
    order = order[half[order] >= 0].astype(np.int32)
    xs, ys = x_steps.astype(np.float32), y_steps.astype(np.float32)

    def work(start: int, stop: int) -> None:
        _sweep(
            images, xs, ys, half, order, reference, labels_px, np.float32(truncation),
            start, stop, costs,
        )  # fmt: skip

    run_in_bands(work, len(labels_px))
    return costs


@kernel()
def _sweep(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    order: NDArray[np.int32],
    reference: int,
    labels: NDArray[np.float32],
    truncation: np.float32,
    start: int,
    stop: int,
    costs: NDArray[np.uint8],
) -> None:
    height, width = images.shape[1], images.shape[2]
    sums = np.empty((HALVES, width), np.float32)
    counts = np.empty((HALVES, width), np.float32)
    blend = np.empty(width, np.float32)
    rows = np.empty((3, HALVES, width), np.float32)
    for label in range(start, stop):
        for v in range(height + 1):
            if v < height:
                _half_costs(
                    images, x_steps, y_steps, half, order, images[reference, v], v, labels[label],
                    truncation, blend, sums, counts, rows[v % 3],
                )  # fmt: skip
            if v > 0:
                above = rows[max(v - 2, 0) % 3]
                below = rows[min(v, height - 1) % 3]
                _join_halves(above, rows[(v - 1) % 3], below, truncation, costs[v - 1, label])


@kernel()
def _half_costs(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    order: NDArray[np.int32],
    centre: NDArray[np.float32],
    v: int,
    slope: np.float32,
    truncation: np.float32,
    blend: NDArray[np.float32],
    sums: NDArray[np.float32],
    counts: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Fill `out` (4, W): mean truncated difference of each half, summed over three columns."""
    height, width = images.shape[1], images.shape[2]
    sums[:] = np.float32(0)
    counts[:] = np.float32(0)
    for k in range(len(order)):
        view = order[k]
        h = half[view]
        shift_x = -slope * x_steps[view]
        shift_y = -slope * y_steps[view]
        ix = int(np.floor(shift_x))
        iy = int(np.floor(shift_y))
        fx = np.float32(shift_x - ix)
        fy = np.float32(shift_y - iy)
        step_x = 1 if fx > 0 else 0
        step_y = 1 if fy > 0 else 0
        first = max(0, -ix)
        last = min(width, width - ix - step_x)
        if v + iy < 0 or v + iy + step_y > height - 1 or last <= first:
            continue
        n = last - first
        line = images[view, v + iy]
        if step_y == 1:
            lower = images[view, v + iy + 1]
            for u in range(width):
                blend[u] = line[u] + fy * (lower[u] - line[u])
            line = blend
        a = line[first + ix : first + ix + n]
        b = line[first + ix + step_x : first + ix + step_x + n]
        c = centre[first:last]
        total = sums[h, first:last]
        count = counts[h, first:last]
        for u in range(n):
            d = abs(a[u] + fx * (b[u] - a[u]) - c[u])
            total[u] += min(truncation, d)
            count[u] += np.float32(1)
    for h in range(HALVES):
        total, count, row = sums[h], counts[h], out[h]
        for u in range(width):
            total[u] = total[u] / count[u] if count[u] > 0 else _UNSEEN
        inner, left, right = row[1 : width - 1], total[: width - 2], total[2:]
        middle = total[1 : width - 1]
        for u in range(width - 2):
            inner[u] = left[u] + middle[u] + right[u]
        row[0] = np.float32(2) * total[0] + total[1]
        row[width - 1] = np.float32(2) * total[width - 1] + total[width - 2]


@kernel()
def _join_halves(
    above: NDArray[np.float32],
    here: NDArray[np.float32],
    below: NDArray[np.float32],
    truncation: np.float32,
    out: NDArray[np.uint8],
) -> None:
    """Per axis the better half, raised a little by the worse one; then the sum of both axes."""
    width = len(out)
    full = np.float32(9) * truncation
    limit = _EXCESS * full
    scale = np.float32(COST_MAX) / (np.float32(2) * full)
    for u in range(width):
        left = above[0, u] + here[0, u] + below[0, u]
        right = above[1, u] + here[1, u] + below[1, u]
        up = above[2, u] + here[2, u] + below[2, u]
        down = above[3, u] + here[3, u] + below[3, u]
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
    return low + (min(limit, gap))
