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

from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
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


@kernel()
def double_row(thin: NDArray[Any], is_odd: bool, full: NDArray[Any]) -> None:
    """Fill in one row as `doubled` does; a row that is not thin is copied."""
    width = len(full)
    if len(thin) == width:
        full[:] = thin
        return
    odd = 1 if is_odd else 0
    full[0] = thin[0]
    rest = full[odd:]
    for k in range(len(rest) // 2):
        rest[2 * k] = thin[k]
        rest[2 * k + 1] = thin[k]
    if len(rest) % 2:
        rest[len(rest) - 1] = thin[len(rest) // 2]


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
    full = np.empty((2, *start_px.shape), np.float32)
    per_slope, per_grey = np.float32(1 / slope_gate_px), np.float32(1 / grey_gate)

    def work(start: int, stop: int) -> None:
        _fill(
            slope_px, variance, thin_start_px, thin_grey, start_px, grey, per_slope, per_grey,
            start, stop, full,
        )  # fmt: skip

    run_in_bands(work, len(full[0]))
    return full[0], full[1]


@kernel()
def _fill(
    slope_px: NDArray[np.float32],
    variance: NDArray[np.float32],
    thin_start_px: NDArray[np.float32],
    thin_grey: NDArray[np.float32],
    start_px: NDArray[np.float32],
    grey: NDArray[np.float32],
    per_slope: np.float32,
    per_grey: np.float32,
    first: int,
    last: int,
    full: NDArray[np.float32],
) -> None:
    """Fill in slope and variance (2, H, W) of both colours, row by row.

    Three rows of the first colour go along, framed by a variance of -1, where nothing is known.
    """
    height, thin = slope_px.shape
    width = start_px.shape[1]
    rows = np.full((3, _MAPS, thin + 2), -1, np.float32)
    own, found = np.empty((2, thin), np.float32), np.empty((2, thin), np.float32)
    sums, share = np.empty((3, thin), np.float32), np.empty(thin, np.float32)
    for v in range(first - 1, last + 1):
        new = rows[(v + 1) % 3]
        if 0 <= v < height:
            _frame(slope_px[v], variance[v], thin_start_px[v], thin_grey[v], new)
        else:
            new[_VARIANCE] = np.float32(-1)
        if v <= first:
            continue
        here = v - 1
        odd = here % 2
        sums[:] = np.float32(0)
        _pick(start_px[here], grey[here], 1 - odd, own)
        for side in range(4):
            there = rows[(here + (1, 1, 0, 2)[side]) % 3]
            at = (1 - odd, 2 - odd, 1, 1)[side]
            _weigh(
                there[_VARIANCE, at : at + thin], there[_START, at : at + thin],
                there[_GREY, at : at + thin], own[0], own[1], per_slope, per_grey, share,
            )  # fmt: skip
            _add(share, there[_SLOPE, at : at + thin], there[_VARIANCE, at : at + thin], sums)
        _share_out(sums, own[0], found)
        for k in range(2):
            mine = slope_px[here] if k == 0 else variance[here]
            _join(mine, found[k], width, odd, full[k, here])


@kernel()
def _frame(
    slope: NDArray[np.float32],
    variance: NDArray[np.float32],
    start: NDArray[np.float32],
    grey: NDArray[np.float32],
    framed: NDArray[np.float32],
) -> None:
    """Fill in a row of the first colour, its unknown variance as -1."""
    thin, infinite = len(slope), np.float32(np.inf)
    framed[_SLOPE, 1 : thin + 1] = slope
    framed[_START, 1 : thin + 1] = start
    framed[_GREY, 1 : thin + 1] = grey
    inner = framed[_VARIANCE, 1 : thin + 1]
    for k in range(thin):
        inner[k] = variance[k] if variance[k] < infinite else np.float32(-1)


@kernel()
def _pick(
    start: NDArray[np.float32], grey: NDArray[np.float32], first: int, own: NDArray[np.float32]
) -> None:
    """Fill in every second pixel of a row, from `first` on; what lies outside stays as it was."""
    count = (len(start) - first + 1) // 2
    slopes, greys = own[0], own[1]
    starts, light = start[first:], grey[first:]
    for k in range(count):
        slopes[k] = starts[2 * k]
    for k in range(count):
        greys[k] = light[2 * k]


@kernel()
def _add(
    share: NDArray[np.float32],
    slope: NDArray[np.float32],
    variance: NDArray[np.float32],
    sums: NDArray[np.float32],
) -> None:
    weight, total, spread = sums[0], sums[1], sums[2]
    for k in range(len(share)):
        weight[k] += share[k]
    for k in range(len(share)):
        total[k] += share[k] * slope[k]
    for k in range(len(share)):
        spread[k] += share[k] * variance[k]


@kernel()
def _share_out(
    sums: NDArray[np.float32], start: NDArray[np.float32], found: NDArray[np.float32]
) -> None:
    """Fill in the mean slope and variance; the slope before, and infinite, where none agrees."""
    weight, total, spread = sums[0], sums[1], sums[2]
    slope, variance = found[0], found[1]
    for k in range(len(start)):
        known = weight[k] > np.float32(1e-6)
        slope[k] = total[k] / weight[k] if known else start[k]
    for k in range(len(start)):
        known = weight[k] > np.float32(1e-6)
        variance[k] = spread[k] / weight[k] if known else np.float32(np.inf)


@kernel()
def _join(
    mine: NDArray[np.float32],
    other: NDArray[np.float32],
    width: int,
    odd: int,
    full: NDArray[np.float32],
) -> None:
    """Fill in a row of the picture from both colours, the first one at even or at odd columns."""
    even_ones, odd_ones = (other, mine) if odd else (mine, other)
    for k in range(width // 2):
        full[2 * k] = even_ones[k]
        full[2 * k + 1] = odd_ones[k]
    if width % 2:
        full[width - 1] = even_ones[width // 2]


@kernel()
def _weigh(
    variance: NDArray[np.float32],
    start: NDArray[np.float32],
    grey: NDArray[np.float32],
    own_start: NDArray[np.float32],
    own_grey: NDArray[np.float32],
    per_slope: np.float32,
    per_grey: np.float32,
    share: NDArray[np.float32],
) -> None:
    """Fill in how much the neighbours on one side count."""
    one, zero = np.float32(1), np.float32(0)
    for k in range(len(share)):
        d = (start[k] - own_start[k]) * per_slope
        g = (grey[k] - own_grey[k]) * per_grey
        near, like = max(one - d * d, zero), one / (one + g * g)
        w = near * near * like * like
        share[k] = w if variance[k] >= zero else zero
