"""Guided weighted median near slope discontinuities.

Aggregation fattens the foreground by about its window. Where slopes jump, the reference view knows
better where the edge is: neighbours of like grey value vote. Ma, He, Wei, Sun and Wu, "Constant
time weighted median filtering for stereo matching and beyond" (ICCV 2013). Only near jumps: inside
a surface the filter would flatten what is tilted.
"""

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.rank import jumps

_RADIUS_PX = 4
_BLOCK = 128
_HALVINGS = 5
_LIKE_NONE = np.float32(1e15)
"""A grey value that no other resembles."""


def settle_edges(
    slope_px: NDArray[np.float32],
    grey: NDArray[np.float32],
    movable: NDArray[np.bool_],
    *,
    jump_px: float,
    grey_scale: float,
    rounds: int,
) -> NDArray[np.float32]:
    """Move slope edges to the grey edges of the reference view, where they may move, (H, W).

    Args:
        slope_px: (H, W).
        grey: (H, W) reference view.
        movable: (H, W) pixels that may change.
        jump_px: difference of neighbours that is an edge.
        grey_scale: see `guided_median`.
        rounds: how often.
    """
    for _ in range(rounds):
        jumping = near_jumps(slope_px, jump_px, _RADIUS_PX)
        slope_px = guided_median(
            slope_px, grey, jumping & movable, radius_px=_RADIUS_PX, grey_scale=grey_scale
        )
    return slope_px


def near_jumps(slope_px: NDArray[np.float32], jump_px: float, radius_px: int) -> NDArray[np.bool_]:
    """Pixels within `radius_px` of a place where neighbouring slopes differ by over `jump_px`."""
    size = 2 * radius_px + 1
    reach = np.ones((size, size), np.uint8)
    near = cv2.dilate(jumps(slope_px, jump_px).view(np.uint8), reach)
    return cast("NDArray[np.uint8]", near).view(np.bool_)


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
    places = np.divmod(np.flatnonzero(where), slope_px.shape[1])
    rows, columns = (part.astype(np.int32) for part in places)
    reach = np.arange(-radius_px, radius_px + 1, dtype=np.int32)
    dy, dx = np.meshgrid(reach, reach, indexing="ij")
    votes = (dy + dx) % 2 == 0
    taps = np.stack([dy[votes], dx[votes]], axis=1)

    def work(start: int, stop: int) -> None:
        part = slice(start, stop)
        _median(slope_px, grey, rows[part], columns[part], taps, np.float32(1 / grey_scale), result)

    run_in_bands(work, len(rows))
    return result


@kernel()
def _median(
    slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    taps: NDArray[np.int32],
    per_scale: np.float32,
    result: NDArray[np.float32],
) -> None:
    """Halve the interval that holds the median, for a block of pixels at a time.

    Nothing outside the picture has a say: a grey value that resembles none stands for it, and the
    slope of the nearest pixel, which is in the window as well and keeps the interval as it is.
    """
    values = np.zeros((len(taps), _BLOCK), np.float32)
    weights = np.zeros((len(taps), _BLOCK), np.float32)
    half, below, bottom, width = (
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
    )
    own_grey, high = np.zeros(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    for first in range(0, len(rows), _BLOCK):
        count = min(_BLOCK, len(rows) - first)
        last = first + count
        for i in range(count):
            own_grey[i] = grey[rows[first + i], columns[first + i]]
        half[:] = np.float32(0)
        for k in range(len(taps)):
            _fetch(
                slope, grey, rows[first:last], columns[first:last], taps[k, 0], taps[k, 1],
                values[k], weights[k],
            )  # fmt: skip
            _weigh(weights[k], own_grey, per_scale, half)
        _bound(values, bottom, high)
        for i in range(_BLOCK):
            width[i] = (high[i] - bottom[i]) * np.float32(1.0001)
            half[i] *= np.float32(0.5)
        _halve(values, weights, half, bottom, width, below)
        below[:] = np.float32(0)
        half[:] = np.float32(0)
        for k in range(len(taps)):
            _add_inside(values[k], weights[k], bottom, width, below, half)
        for i in range(count):
            if below[i] > 0:
                result[rows[first + i], columns[first + i]] = half[i] / below[i]


@kernel()
def _halve(
    values: NDArray[np.float32],
    weights: NDArray[np.float32],
    half: NDArray[np.float32],
    bottom: NDArray[np.float32],
    width: NDArray[np.float32],
    below: NDArray[np.float32],
) -> None:
    """Move the bottom of each interval up where less than half of the weight lies below."""
    middle = np.empty(_BLOCK, np.float32)
    for _ in range(_HALVINGS):
        below[:] = np.float32(0)
        for i in range(_BLOCK):
            width[i] *= np.float32(0.5)
            middle[i] = bottom[i] + width[i]
        for k in range(len(values)):
            _add_below(values[k], weights[k], middle, below)
        for i in range(_BLOCK):
            # A sum, and no choice of what to store: that would be slow on some processors.
            bottom[i] += width[i] if below[i] < half[i] else np.float32(0)


@kernel()
def _bound(
    values: NDArray[np.float32], low: NDArray[np.float32], high: NDArray[np.float32]
) -> None:
    """Fill in the lowest and the highest value of every pixel of a block, two taps at a time."""
    least, most = values[0].copy(), values[0].copy()
    for k in range(1, len(values), 2):
        one, other = values[k], values[min(k + 1, len(values) - 1)]
        for i in range(_BLOCK):
            low[i] = min(least[i], one[i], other[i])
        for i in range(_BLOCK):
            high[i] = max(most[i], one[i], other[i])
        least[:], most[:] = low, high


@kernel()
def _fetch(
    slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    down: np.int32,
    right: np.int32,
    values: NDArray[np.float32],
    greys: NDArray[np.float32],
) -> None:
    height, width = slope.shape
    for i in range(len(rows)):
        v, u = rows[i] + down, columns[i] + right
        y, x = min(max(v, 0), height - 1), min(max(u, 0), width - 1)
        values[i] = slope[y, x]
        greys[i] = grey[y, x] if (y == v) & (x == u) else _LIKE_NONE


@kernel()
def _weigh(
    weights: NDArray[np.float32],
    own_grey: NDArray[np.float32],
    per_scale: np.float32,
    total: NDArray[np.float32],
) -> None:
    """Turn grey values into weights."""
    one = np.float32(1)
    for i in range(_BLOCK):
        d = (weights[i] - own_grey[i]) * per_scale
        w = one / (one + d * d)
        weights[i] = w * w
        total[i] += w * w


@kernel()
def _add_below(
    values: NDArray[np.float32],
    weights: NDArray[np.float32],
    middle: NDArray[np.float32],
    below: NDArray[np.float32],
) -> None:
    """Add the weight of what lies below the middle of the interval."""
    for i in range(_BLOCK):
        below[i] += weights[i] if values[i] < middle[i] else np.float32(0)


@kernel()
def _add_inside(
    values: NDArray[np.float32],
    weights: NDArray[np.float32],
    bottom: NDArray[np.float32],
    width: NDArray[np.float32],
    weight: NDArray[np.float32],
    weighted: NDArray[np.float32],
) -> None:
    """Add weight, and weight times value, of what lies inside the interval."""
    for i in range(_BLOCK):
        inside = (values[i] >= bottom[i]) & (values[i] < bottom[i] + width[i])
        w = weights[i] if inside else np.float32(0)
        weight[i] += w
        weighted[i] += w * values[i]
