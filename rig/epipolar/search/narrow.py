"""Search around a hypothesis: the half-cost sweep, but each pixel starts from its own slope.

Where a slope N(m, sigma^2) is expected (previous frame, coarser level, plane of a board), a handful
of offsets replaces the whole range; the costs have the shape of `sweep_costs`, so the same
aggregation chooses among them.
"""

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.sampling import pad, sample_points
from rig.epipolar.search.halves import (
    HALVES,
    NO_VIEWS,
    assign_halves,
    join_halves,
    mean_of_three,
    shares_of,
)

_LINES = 6
_COLUMNS, _HERE, _SLOPE, _GREY, _TILT, _SEEN = range(_LINES)
"""What is known of every pixel of a row: its place, its slope, and what a view shows there."""
_TOTAL, _COUNT = range(2)


def narrow_costs(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    centre_px: NDArray[np.float32],
    offsets_px: NDArray[np.float32],
    truncation: float,
) -> NDArray[np.uint8]:
    """Cost of every offset from the expected slope.

    Args:
        images: (V, H, W), equalised grey values.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        reference: index of the reference view.
        centre_px: (H, W) expected slope, px per view step.
        offsets_px: (K,) differences from it to try.
        truncation: grey difference that counts as a full mismatch.

    Returns:
        (H, K, W) costs, 0 to `COST_MAX`.
    """
    height, width = centre_px.shape
    costs = np.empty((height, len(offsets_px), width), np.uint8)
    padded = pad(images, x_steps, y_steps)
    half = assign_halves(x_steps, y_steps)
    has_views = np.isin(np.arange(HALVES), half)
    xs, ys = x_steps.astype(np.float32), y_steps.astype(np.float32)

    def work(start: int, stop: int) -> None:
        lines = np.empty((_LINES, width), np.float32)
        lines[_COLUMNS] = np.arange(width)
        sums = np.empty((2, HALVES, width), np.float32)
        rows = np.full((3, HALVES, width), NO_VIEWS, np.float32)
        for k, offset in enumerate(offsets_px):
            _narrow(
                padded, images[reference], xs, ys, half, centre_px, offset,
                np.float32(truncation), start, stop, lines, sums, has_views, rows, k, costs,
            )  # fmt: skip

    run_in_bands(work, height)
    return costs


@kernel()
def _narrow(
    padded: NDArray[np.float32],
    grey: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    centre: NDArray[np.float32],
    offset: np.float32,
    truncation: np.float32,
    start: int,
    stop: int,
    lines: NDArray[np.float32],
    sums: NDArray[np.float32],
    has_views: NDArray[np.bool_],
    rows: NDArray[np.float32],
    k: int,
    costs: NDArray[np.uint8],
) -> None:
    """Fill in the costs of one offset; those of a row need the rows above and below as well."""
    height, width = grey.shape
    columns, here, slope = lines[_COLUMNS], lines[_HERE], lines[_SLOPE]
    unseen = np.empty((HALVES, width), np.float32)
    for v in range(max(start - 1, 0), stop + 1):
        if v < height:
            for u in range(width):
                here[u] = np.float32(v)
                slope[u] = centre[v, u] + offset
            for h in range(HALVES):
                for u in range(width):
                    sums[_TOTAL, h, u] = np.float32(0)
                    sums[_COUNT, h, u] = np.float32(0)
            for i in range(len(half)):
                if half[i] >= 0:
                    sample_points(
                        padded[i], height, width, columns, here, slope, x_steps[i], y_steps[i],
                        lines[_GREY], lines[_TILT], lines[_SEEN],
                    )  # fmt: skip
                    _add_view(
                        grey[v], lines[_GREY], lines[_SEEN], truncation, sums[_TOTAL, half[i]],
                        sums[_COUNT, half[i]],
                    )  # fmt: skip
            shares_of(sums[_COUNT], unseen)
            mean_of_three(sums[_TOTAL], sums[_COUNT], unseen, has_views, rows[v % 3])
        if v > start:
            above, below = rows[max(v - 2, 0) % 3], rows[min(v, height - 1) % 3]
            join_halves(above, rows[(v - 1) % 3], below, truncation, costs[v - 1, k])


@kernel()
def _add_view(
    centre: NDArray[np.float32],
    grey: NDArray[np.float32],
    seen: NDArray[np.float32],
    truncation: np.float32,
    total: NDArray[np.float32],
    count: NDArray[np.float32],
) -> None:
    for u in range(len(centre)):
        total[u] += seen[u] * min(abs(grey[u] - centre[u]), truncation)
        count[u] += seen[u]
