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

from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands, run_side_by_side
from rig.compute.kernel import kernel
from rig.epipolar.rank import mean_over

Map = NDArray[np.float32]
Values = TypeVar("Values", bound=NDArray[np.generic])

_MAPS = 4
_SLOPE, _VARIANCE, _START, _GREY = range(_MAPS)
"""What is known of the first colour."""


def thinned(values: Values) -> Values:
    """Return the pixels of the first colour of a map (H, W)."""
    thin = _empty(values)

    def work(start: int, stop: int) -> None:
        for odd in (0, 1):
            rows = slice(2 * start + odd, 2 * stop, 2)
            part, source = thin[rows], values[rows, odd::2]
            part[:, : source.shape[1]] = source
            part[:, source.shape[1] :] = values[rows, -1:]

    run_in_bands(work, _pairs_of_rows(values))
    return thin


def _other(values: Map) -> Map:
    """The pixels of the other colour of a map (H, W): column 2 k + 1 - v % 2 of row v."""
    thin = _empty(values)

    def work(start: int, stop: int) -> None:
        for odd in (0, 1):
            rows = slice(2 * start + odd, 2 * stop, 2)
            part, source = thin[rows], values[rows, 1 - odd :: 2]
            part[:, : source.shape[1]] = source
            part[:, source.shape[1] :] = 0

    run_in_bands(work, _pairs_of_rows(values))
    return thin


def doubled(thin: Values, width: int) -> Values:
    """Return a map (H, width) where every pixel of the other colour is as the one beside it.

    Args:
        thin: map of the first colour.
        width: of the picture, px.
    """
    full = np.empty((len(thin), width), thin.dtype)

    def work(start: int, stop: int) -> None:
        even, odd = slice(2 * start, 2 * stop, 2), slice(2 * start + 1, 2 * stop, 2)
        full[even, ::2], full[even, 1::2] = thin[even], thin[even, : width // 2]
        full[odd, 1::2], full[odd, 0] = thin[odd, : width // 2], thin[odd, 0]
        full[odd, 2::2] = thin[odd, : (width - 1) // 2]

    run_in_bands(work, _pairs_of_rows(thin))
    return cast("Values", full)


def _joined(thin: Values, other: Values, width: int) -> Values:
    """Join thin maps of both colours to one (H, width)."""
    full = np.empty((len(thin), width), thin.dtype)
    more, less = (width + 1) // 2, width // 2

    def work(start: int, stop: int) -> None:
        even, odd = slice(2 * start, 2 * stop, 2), slice(2 * start + 1, 2 * stop, 2)
        full[even, ::2], full[even, 1::2] = thin[even, :more], other[even, :less]
        full[odd, 1::2], full[odd, ::2] = thin[odd, :less], other[odd, :more]

    run_in_bands(work, _pairs_of_rows(thin))
    return cast("Values", full)


def _empty(values: Values) -> Values:
    """A thin map for a map (H, W)."""
    return cast("Values", np.empty((len(values), (values.shape[1] + 1) // 2), values.dtype))


def _pairs_of_rows(values: NDArray[np.generic]) -> int:
    return (len(values) + 1) // 2


def mean_around(thin: Map, radius_px: int) -> Map:
    """Mean over a square window of the picture, as near as the pattern allows, at its pixels."""
    return mean_over(thin, radius_px // 2, radius_px)


def filled(
    slope_px: Map,
    variance: Map,
    thin_start_px: Map,
    thin_grey: Map,
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
        thin_start_px: thin map of `start_px`.
        thin_grey: thin map of `grey`.
        start_px: (H, W) slopes before, which tell surfaces apart.
        grey: (H, W) reference view.
        slope_gate_px: difference of slope from which a neighbour does not count (Tukey biweight).
        grey_gate: difference of grey value at which a neighbour counts a quarter.

    Returns:
        Slope and variance, (H, W) each; where no neighbour agrees, the slope before, and infinite.
    """
    height, width = slope_px.shape
    framed = np.full((_MAPS, height + 2, width + 2), -1, np.float32)
    maps = slope_px, np.where(np.isfinite(variance), variance, -1), thin_start_px, thin_grey
    other_start, other_grey = run_side_by_side(lambda: _other(start_px), lambda: _other(grey))
    found = np.empty((2, height, width), np.float32)

    def frame(first: int, last: int) -> None:
        for target, values in zip(framed[first:last], maps[first:last], strict=True):
            target[1:-1, 1:-1] = values

    per_slope, per_grey = np.float32(1 / slope_gate_px), np.float32(1 / grey_gate)

    def work(start: int, stop: int) -> None:
        _fill(framed, other_start, other_grey, per_slope, per_grey, start, stop, found)

    run_in_bands(frame, _MAPS)
    run_in_bands(work, height)
    full = start_px.shape[1]
    slope, spread = run_side_by_side(
        lambda: _joined(slope_px, found[0], full), lambda: _joined(variance, found[1], full)
    )
    return slope, spread


@kernel()
def _fill(
    framed: NDArray[np.float32],
    start_px: NDArray[np.float32],
    grey: NDArray[np.float32],
    per_slope: np.float32,
    per_grey: np.float32,
    first: int,
    last: int,
    found: NDArray[np.float32],
) -> None:
    """Fill in slope and variance (2, H, W / 2) of the other colour.

    `framed` (4, H + 2, W / 2 + 2) has a variance of -1 where nothing is known, its frame included.
    """
    thin = start_px.shape[1]
    sums, share = np.empty((3, thin), np.float32), np.empty(thin, np.float32)
    for v in range(first, last):
        sums[:] = np.float32(0)
        weight, total, spread = sums[0], sums[1], sums[2]
        for side in range(4):
            row = v + (1, 1, 0, 2)[side]
            column = (1 - v % 2, 2 - v % 2, 1, 1)[side]
            there = framed[:, row, column : column + thin]
            _weigh(there, start_px[v], grey[v], per_slope, per_grey, share)
            for k in range(thin):
                weight[k] += share[k]
            slope, variance = there[_SLOPE], there[_VARIANCE]
            for k in range(thin):
                total[k] += share[k] * slope[k]
            for k in range(thin):
                spread[k] += share[k] * variance[k]
        start, slope, variance = start_px[v], found[0, v], found[1, v]
        for k in range(thin):
            known = weight[k] > np.float32(1e-6)
            slope[k] = total[k] / weight[k] if known else start[k]
        for k in range(thin):
            known = weight[k] > np.float32(1e-6)
            variance[k] = spread[k] / weight[k] if known else np.float32(np.inf)


@kernel()
def _weigh(
    there: NDArray[np.float32],
    here: NDArray[np.float32],
    light: NDArray[np.float32],
    per_slope: np.float32,
    per_grey: np.float32,
    share: NDArray[np.float32],
) -> None:
    """Fill in how much the neighbours on one side count."""
    one, zero = np.float32(1), np.float32(0)
    variance, start, grey = there[_VARIANCE], there[_START], there[_GREY]
    for k in range(len(share)):
        d = (start[k] - here[k]) * per_slope
        g = (grey[k] - light[k]) * per_grey
        near, like = max(one - d * d, zero), one / (one + g * g)
        w = near * near * like * like
        share[k] = w if variance[k] >= zero else zero
