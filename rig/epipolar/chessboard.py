"""Every second pixel, in the pattern of a chess-board: half the work in frames that are followed.

Neighbours are joined over a window of many pixels (`rig.epipolar.stitch`), and each pixel is joined
with those of its own colour only. What the other colour would find is what lies between: its four
neighbours belong to the first colour, and those that are of its surface stand for it (quincunx
sampling: E. Viscito and J. P. Allebach, "The analysis and design of multidimensional FIR perfect
reconstruction filter banks for arbitrary sampling lattices", IEEE Trans. Circuits and Systems 38,
1991).

A thin map is packed, (H, ceil(W / 2)): pixel k of row v is column 2 k + v % 2 of the picture. Where
that lies outside (W odd), it is the last column once more.
"""

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel

Map = NDArray[np.float32]
Values = TypeVar("Values", bound=NDArray[np.generic])

_MAPS = 4
_SLOPE, _VARIANCE, _START, _GREY = range(_MAPS)
"""What is known of the first colour."""


def thinned(values: Values) -> Values:
    """Return the pixels of the first colour of a map (H, W)."""
    height, width = values.shape
    thin = np.empty((height, (width + 1) // 2), values.dtype)
    thin[::2] = values[::2, ::2]
    odd = values[1::2, 1::2]
    thin[1::2, : odd.shape[1]] = odd
    thin[1::2, odd.shape[1] :] = values[1::2, -1:]
    return thin


def doubled(thin: Values, width: int) -> Values:
    """Return a map (H, width) where every pixel of the other colour is as the one beside it.

    Args:
        thin: map of the first colour.
        width: of the picture, px.
    """
    beside = thin
    if width > 1:
        beside = np.empty_like(thin)
        beside[::2], beside[1::2, 1:], beside[1::2, 0] = thin[::2], thin[1::2, :-1], thin[1::2, 0]
    return _joined(thin, beside, width)


def _joined(thin: Values, other: Values, width: int) -> Values:
    """Join thin maps of both colours to one (H, width)."""
    full = np.empty((len(thin), width), thin.dtype)
    more, less = (width + 1) // 2, width // 2
    full[::2, ::2], full[::2, 1::2] = thin[::2, :more], other[::2, :less]
    full[1::2, 1::2], full[1::2, ::2] = thin[1::2, :less], other[1::2, :more]
    return full


def _other(values: Map) -> Map:
    """The pixels of the other colour of a map (H, W): column 2 k + 1 - v % 2 of row v."""
    height, width = values.shape
    thin = np.zeros((height, (width + 1) // 2), np.float32)
    thin[::2, : width // 2], thin[1::2] = values[::2, 1::2], values[1::2, ::2]
    return thin


def mean_around(thin: Map, radius_px: int) -> Map:
    """Mean over a square window of the picture, as near as the pattern allows, at its pixels."""
    return np.asarray(cv2.blur(thin, (2 * (radius_px // 2) + 1, 2 * radius_px + 1)), np.float32)


def filled(
    slope_px: Map,
    variance: Map,
    start_px: Map,
    grey: Map,
    *,
    slope_gate_px: float,
    grey_gate: float,
) -> tuple[Map, Map]:
    """Fill in the other colour: the mean of the neighbours that are of a pixel's own surface.

    Args:
        slope_px: thin map of slopes.
        variance: thin map of their variance, infinite where nothing is known.
        start_px: (H, W) slopes before, which tell surfaces apart.
        grey: (H, W) reference view.
        slope_gate_px: difference of slope from which a neighbour does not count (Tukey biweight).
        grey_gate: difference of grey value at which a neighbour counts a quarter.

    Returns:
        Slope and variance, (H, W) each; where no neighbour agrees, the slope before, and infinite.
    """
    known = np.where(np.isfinite(variance), variance, np.float32(-1))
    maps = slope_px, known, thinned(start_px), thinned(grey)
    framed = np.stack([
        cv2.copyMakeBorder(one, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=-1) for one in maps
    ])  # fmt: skip
    own = np.stack([_other(start_px), _other(grey)])
    found = np.empty_like(own)
    per_slope, per_grey = np.float32(1 / slope_gate_px), np.float32(1 / grey_gate)

    def work(start: int, stop: int) -> None:
        _fill(framed, own, per_slope, per_grey, start, stop, found)

    run_in_bands(work, len(start_px))
    width = start_px.shape[1]
    return _joined(slope_px, found[0], width), _joined(variance, found[1], width)


@kernel()
def _fill(
    framed: NDArray[np.float32],
    own: NDArray[np.float32],
    per_slope: np.float32,
    per_grey: np.float32,
    first: int,
    last: int,
    found: NDArray[np.float32],
) -> None:
    """Fill in slope and variance (2, H, W / 2) of the other colour, whose start and grey are `own`.

    `framed` (4, H + 2, W / 2 + 2) has a variance of -1 where nothing is known, its frame included.
    """
    thin = own.shape[2]
    sums = np.empty((3, thin), np.float32)
    for v in range(first, last):
        sums[:] = np.float32(0)
        for side in range(4):
            row = v + (1, 1, 0, 2)[side]
            column = (1 - v % 2, 2 - v % 2, 1, 1)[side]
            there = framed[:, row, column : column + thin]
            _add_neighbour(there, own[:, v], per_slope, per_grey, sums)
        weight, total, spread = sums[0], sums[1], sums[2]
        start, slope, variance = own[0, v], found[0, v], found[1, v]
        for k in range(thin):
            known = weight[k] > np.float32(1e-6)
            slope[k] = total[k] / weight[k] if known else start[k]
        for k in range(thin):
            known = weight[k] > np.float32(1e-6)
            variance[k] = spread[k] / weight[k] if known else np.float32(np.inf)


@kernel()
def _add_neighbour(
    there: NDArray[np.float32],
    own: NDArray[np.float32],
    per_slope: np.float32,
    per_grey: np.float32,
    sums: NDArray[np.float32],
) -> None:
    """Add the neighbour on one side to the sums of weights, of slopes and of variances.

    What belongs together lies in one array: then the compiler need not ask whether any overlap.
    """
    one, zero = np.float32(1), np.float32(0)
    slope, variance, start, grey = there[_SLOPE], there[_VARIANCE], there[_START], there[_GREY]
    here, light = own[0], own[1]
    weight, total, spread = sums[0], sums[1], sums[2]
    for k in range(len(weight)):
        d = (start[k] - here[k]) * per_slope
        g = (grey[k] - light[k]) * per_grey
        near, like = max(one - d * d, zero), one / (one + g * g)
        w = near * near * like * like if variance[k] >= zero else zero
        weight[k] += w
        total[k] += w * slope[k]
        spread[k] += w * variance[k]
