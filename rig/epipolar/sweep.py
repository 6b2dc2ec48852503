"""Half-cost plane sweep: how badly each slope explains each pixel.

Plane sweep after R. T. Collins, "A space-sweep approach to true multi-image matching" (CVPR 1996),
with half costs (`rig.epipolar.halves`) summed over 3 x 3 pixels.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.halves import HALVES, assign_halves, join_halves, mean_of_three
from rig.epipolar.kernel import kernel


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
                join_halves(above, rows[(v - 1) % 3], below, truncation, costs[v - 1, label])


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
    for h in range(HALVES):
        for u in range(width):
            sums[h, u] = np.float32(0)
            counts[h, u] = np.float32(0)
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
    mean_of_three(sums, counts, out)
