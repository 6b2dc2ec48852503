"""Guided weighted median near slope discontinuities.

Aggregation fattens the foreground by about its window. Where slopes jump, the reference view knows
better where the edge is: neighbours of like grey value vote. Ma, He, Wei, Sun and Wu, "Constant
time weighted median filtering for stereo matching and beyond" (ICCV 2013). Only near jumps: inside
a surface the filter would flatten what is tilted.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.kernel import kernel
from rig.epipolar.rank import highest, lowest

_BINS = 64


def near_jumps(slope_px: NDArray[np.float32], jump_px: float, radius_px: int) -> NDArray[np.bool_]:
    """Pixels within `radius_px` of a place where neighbouring slopes differ by over `jump_px`."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    spread = cv2.morphologyEx(slope_px, cv2.MORPH_GRADIENT, cross)
    size = 2 * radius_px + 1
    reach = np.ones((size, size), np.uint8)
    return cv2.dilate((spread > jump_px).astype(np.uint8), reach).astype(bool)


def guided_median(
    slope_px: NDArray[np.float32],
    grey: NDArray[np.float32],
    where: NDArray[np.bool_],
    *,
    radius_px: int,
    grey_scale: float,
) -> NDArray[np.float32]:
    """Replace the slope at `where` by the median of its neighbours, weighted by likeness of grey.

    Every second pixel of the window votes, in the pattern of a chess-board.

    Args:
        slope_px: (H, W).
        grey: (H, W) reference view.
        where: (H, W) pixels to replace.
        radius_px: half width of the window.
        grey_scale: grey difference at which a neighbour's weight falls to a quarter.
    """
    result = slope_px.copy()
    low, high = lowest(slope_px, radius_px), highest(slope_px, radius_px)
    rows, columns = (index.astype(np.int32) for index in np.nonzero(where))

    def work(start: int, stop: int) -> None:
        _median(
            slope_px, grey, low, high, rows, columns, radius_px, np.float32(1 / grey_scale),
            start, stop, result,
        )  # fmt: skip

    run_in_bands(work, len(rows))
    return result


@kernel()
def _median(
    slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    lows: NDArray[np.float32],
    highs: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    radius: int,
    per_scale: np.float32,
    start: int,
    stop: int,
    result: NDArray[np.float32],
) -> None:
    height, width = slope.shape
    weights = np.empty(_BINS, np.float32)
    sums = np.empty(_BINS, np.float32)
    for k in range(start, stop):
        v, u = rows[k], columns[k]
        top, bottom = max(v - radius, 0), min(v + radius + 1, height)
        left, right = max(u - radius, 0), min(u + radius + 1, width)
        low, high = lows[v, u], highs[v, u]
        if high <= low:
            continue
        per_bin = np.float32(_BINS - 1) / (high - low)
        for i in range(_BINS):
            weights[i] = np.float32(0)
            sums[i] = np.float32(0)
        total = np.float32(0)
        for y in range(top, bottom):
            for x in range(left + (left + y + u + v) % 2, right, 2):
                d = (grey[y, x] - grey[v, u]) * per_scale
                w = np.float32(1) / (np.float32(1) + d * d)
                w *= w
                i = int((slope[y, x] - low) * per_bin)
                weights[i] += w
                sums[i] += w * slope[y, x]
                total += w
        below = np.float32(0)
        for i in range(_BINS):
            below += weights[i]
            if below >= np.float32(0.5) * total:
                result[v, u] = sums[i] / weights[i]
                break
