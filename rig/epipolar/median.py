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

from rig.compute.bands import run_in_bands, run_side_by_side
from rig.compute.kernel import kernel
from rig.epipolar.rank import highest, jumps, lowest

_BLOCK = 128
_HALVINGS = 5


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
    places = np.flatnonzero(where)
    own = slope_px.ravel()[places], grey.ravel()[places]
    bounds = run_side_by_side(
        lambda: lowest(slope_px, radius_px).ravel()[places],
        lambda: highest(slope_px, radius_px).ravel()[places],
    )
    stride = slope_px.shape[1] + 2 * radius_px
    rows, columns = np.divmod(places, slope_px.shape[1])
    framed = ((rows + radius_px) * stride + columns + radius_px).astype(np.int32)
    dy, dx = np.mgrid[-radius_px : radius_px + 1, -radius_px : radius_px + 1]
    taps = (dy * stride + dx)[(dy + dx) % 2 == 0].astype(np.int32)
    # Grey values outside the picture resemble none, so that nothing outside has a say.
    slopes, greys = run_side_by_side(
        lambda: np.pad(slope_px, radius_px).ravel(),
        lambda: np.pad(grey, radius_px, constant_values=1e15).ravel(),
    )
    found = np.empty(len(places), np.float32)

    def work(start: int, stop: int) -> None:
        part = slice(start, stop)
        _median(
            slopes, greys, framed[part], taps, own[0][part], own[1][part], bounds[0][part],
            bounds[1][part], np.float32(1 / grey_scale), found[part],
        )  # fmt: skip

    run_in_bands(work, len(places))
    result.ravel()[places] = found
    return result


@kernel()
def _median(
    slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    places: NDArray[np.int32],
    taps: NDArray[np.int32],
    own_slope: NDArray[np.float32],
    own_grey: NDArray[np.float32],
    low: NDArray[np.float32],
    high: NDArray[np.float32],
    per_scale: np.float32,
    found: NDArray[np.float32],
) -> None:
    """Halve the interval that holds the median, for a block of pixels at a time."""
    values = np.empty((len(taps), _BLOCK), np.float32)
    weights = np.empty((len(taps), _BLOCK), np.float32)
    half, below, bottom, middle, width = (
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
        np.empty(_BLOCK, np.float32),
    )
    for first in range(0, len(places), _BLOCK):
        count = min(_BLOCK, len(places) - first)
        last = first + count
        half[:] = np.float32(0)
        for k in range(len(taps)):
            _fetch(slope, grey, places[first:last], taps[k], values[k], weights[k])
            _weigh(weights[k], own_grey[first:last], per_scale, half)
        for i in range(count):
            bottom[i] = low[first + i]
            width[i] = (high[first + i] - bottom[i]) * np.float32(1.0001)
            half[i] *= np.float32(0.5)
        for _ in range(_HALVINGS):
            below[:] = np.float32(0)
            for i in range(_BLOCK):
                width[i] *= np.float32(0.5)
                middle[i] = bottom[i] + width[i]
            for k in range(len(taps)):
                _add_below(values[k], weights[k], middle, below)
            for i in range(_BLOCK):
                bottom[i] = middle[i] if below[i] < half[i] else bottom[i]
        below[:] = np.float32(0)
        half[:] = np.float32(0)
        for k in range(len(taps)):
            _add_inside(values[k], weights[k], bottom, width, below, half)
        for i in range(count):
            mean = half[i] / below[i]
            found[first + i] = mean if below[i] > 0 else own_slope[first + i]


@kernel()
def _fetch(
    slope: NDArray[np.float32],
    grey: NDArray[np.float32],
    places: NDArray[np.int32],
    tap: np.int32,
    values: NDArray[np.float32],
    greys: NDArray[np.float32],
) -> None:
    for i in range(len(places)):
        k = np.uintp(np.uint32(places[i] + tap))
        values[i] = slope[k]
        greys[i] = grey[k]


@kernel()
def _weigh(
    weights: NDArray[np.float32],
    own_grey: NDArray[np.float32],
    per_scale: np.float32,
    total: NDArray[np.float32],
) -> None:
    """Turn grey values into weights."""
    one = np.float32(1)
    for i in range(len(own_grey)):
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
