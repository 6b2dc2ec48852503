"""Half-cost plane sweep: how badly each slope explains each pixel.

Plane sweep after R. T. Collins, "A space-sweep approach to true multi-image matching" (CVPR 1996),
with half costs (`rig.epipolar.search.halves`) summed over 3 x 3 pixels.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.drift_fit import drift_of_all
from rig.epipolar.search.halves import (
    HALVES,
    NO_VIEWS,
    assign_halves,
    is_beside,
    join_halves,
    mean_of_three,
    shares_of,
)


def sweep_costs(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float64],
    y_steps: NDArray[np.float64],
    reference: int,
    labels_px: NDArray[np.float32],
    truncation: float,
    centres: NDArray[np.float32] | None = None,
    drift: NDArray[np.float32] | None = None,
) -> NDArray[np.uint8]:
    """Cost of every slope at every pixel.

    Args:
        images: (V, H, W), equalised grey values.
        x_steps: (V,) view columns, view steps.
        y_steps: (V,) view rows, view steps.
        reference: index of the reference view.
        labels_px: (L,) slopes to try, px per view step.
        truncation: grey difference that counts as a full mismatch.
        centres: (2, H, W) what views beside the reference, and those above and below it, are
            compared with (`contrast.raise_texture`); None for the reference as it is.
        drift: (2, H, W) light that changes with the view, see `rig.epipolar.drift`; None for none.

    Returns:
        (H, L, W) costs, 0 to `COST_MAX`.
    """
    height, width = images.shape[1:]
    compared, axis = images[reference][None], np.zeros(len(images), np.int32)
    if centres is not None:
        compared = centres
        axis = (~is_beside(x_steps, y_steps)).astype(np.int32)
    costs = np.empty((height, len(labels_px), width), np.uint8)
    half = assign_halves(x_steps, y_steps)
    order = np.argsort(half, kind="stable")
    order = order[half[order] >= 0].astype(np.int32)
    xs, ys = x_steps.astype(np.float32), y_steps.astype(np.float32)
    light = drift_of_all(drift)

    def work(start: int, stop: int) -> None:
        _sweep(
            images, xs, ys, half, order, axis, compared, labels_px, np.float32(truncation),
            light, start, stop, costs,
        )  # fmt: skip

    run_in_bands(work, len(labels_px))
    return costs


def average(costs: NDArray[np.uint8], other: NDArray[np.uint8]) -> None:
    """Turn costs (H, L, W) into the mean of them and of others."""

    def work(start: int, stop: int) -> None:
        for row in range(start, stop):
            cv2.addWeighted(costs[row], 0.5, other[row], 0.5, 0.0, dst=costs[row])

    run_in_bands(work, len(costs))


@kernel()
def _sweep(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    order: NDArray[np.int32],
    axis: NDArray[np.int32],
    centres: NDArray[np.float32],
    labels: NDArray[np.float32],
    truncation: np.float32,
    drift: NDArray[np.float32],
    start: int,
    stop: int,
    costs: NDArray[np.uint8],
) -> None:
    height, width = images.shape[1], images.shape[2]
    sums, shares, unseen = (
        np.empty((HALVES, width), np.float32),
        np.empty((HALVES, width), np.float32),
        np.empty((HALVES, width), np.float32),
    )
    blend = np.empty(width, np.float32)
    rows = np.full((3, HALVES, width), NO_VIEWS, np.float32)
    has_views = np.zeros(HALVES, np.bool_)
    for k in range(len(order)):
        has_views[half[order[k]]] = True
    for label in range(start, stop):
        slope = labels[label]
        for v in range(height + 1):
            if v < height:
                if v == 0 or _views_change(height, y_steps, order, v, slope):
                    _count_views(height, x_steps, y_steps, half, order, v, slope, shares)
                    shares_of(shares, unseen)
                _half_sums(
                    images, x_steps, y_steps, half, order, axis, centres, v, slope, truncation,
                    drift, blend, sums,
                )  # fmt: skip
                mean_of_three(sums, shares, unseen, has_views, rows[v % 3])
            if v > 0:
                above = rows[max(v - 2, 0) % 3]
                below = rows[min(v, height - 1) % 3]
                join_halves(above, rows[(v - 1) % 3], below, truncation, costs[v - 1, label])


@kernel()
def _views_change(
    height: int, y_steps: NDArray[np.float32], order: NDArray[np.int32], v: int, slope: np.float32
) -> bool:
    """Whether another choice of views shows row v than the row above it."""
    change = False
    for k in range(len(order)):
        shift = np.float32(-slope * y_steps[order[k]])
        change |= _shows_row(height, v, shift) != _shows_row(height, v - 1, shift)
    return change


@kernel()
def _shows_row(height: int, v: int, shift: np.float32) -> bool:
    """Whether a picture holds all rows that a row moved by `shift` is blended from."""
    whole = int(np.floor(shift))
    return bool(v + whole >= 0 and v + whole + (shift > whole) <= height - 1)


@kernel()
def _columns(width: int, shift: np.float32) -> tuple[int, int]:
    """First column, and one past the last, that a picture shows of a row moved by `shift`."""
    whole = int(np.floor(shift))
    return max(0, -whole), min(width, width - whole - (1 if shift > whole else 0))


@kernel()
def _count_views(
    height: int,
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    order: NDArray[np.int32],
    v: int,
    slope: np.float32,
    counts: NDArray[np.float32],
) -> None:
    """Fill in how many views of each half (4, W) show the pixels of row v."""
    counts[:] = np.float32(0)
    for k in range(len(order)):
        view = order[k]
        shift_x, shift_y = np.float32(-slope * x_steps[view]), np.float32(-slope * y_steps[view])
        if _shows_row(height, v, shift_y):
            first, last = _columns(counts.shape[1], shift_x)
            count = counts[half[view]]
            for u in range(first, last):
                count[u] += np.float32(1)


@kernel()
def _half_sums(
    images: NDArray[np.float32],
    x_steps: NDArray[np.float32],
    y_steps: NDArray[np.float32],
    half: NDArray[np.int32],
    order: NDArray[np.int32],
    axis: NDArray[np.int32],
    centres: NDArray[np.float32],
    v: int,
    slope: np.float32,
    truncation: np.float32,
    drift: NDArray[np.float32],
    blend: NDArray[np.float32],
    sums: NDArray[np.float32],
) -> None:
    """Fill `sums` (4, W): truncated differences of the views of each half, added."""
    height, width = images.shape[1], images.shape[2]
    sums[:] = np.float32(0)
    for k in range(len(order)):
        view = order[k]
        shift_x, shift_y = np.float32(-slope * x_steps[view]), np.float32(-slope * y_steps[view])
        first, last = _columns(width, shift_x)
        if last <= first or not _shows_row(height, v, shift_y):
            continue
        ix, iy = int(np.floor(shift_x)), int(np.floor(shift_y))
        fx, fy = np.float32(shift_x - ix), np.float32(shift_y - iy)
        n = last - first
        line = images[view, v + iy]
        c = centres[axis[view], v, first:last]
        total = sums[half[view], first:last]
        beside, share = line, fx
        if fy > 0:
            beside, share = images[view, v + iy + 1], fy
            if fx > 0:
                for u in range(width):
                    blend[u] = line[u] + fy * (beside[u] - line[u])
                line, share = blend, fx
                beside = line
        step = 1 if fx > 0 else 0
        a = line[first + ix : first + ix + n]
        b = beside[first + ix + step : first + ix + step + n]
        if drift.shape[1] == 0:  # nothing drifts
            for u in range(n):
                d = abs(a[u] + share * (b[u] - a[u]) - c[u])
                total[u] += min(truncation, d)
        else:
            along, down = drift[0, v, first:last], drift[1, v, first:last]
            x_step, y_step = x_steps[view], y_steps[view]
            for u in range(n):
                lit = c[u] + x_step * along[u] + y_step * down[u]
                d = abs(a[u] + share * (b[u] - a[u]) - lit)
                total[u] += min(truncation, d)
