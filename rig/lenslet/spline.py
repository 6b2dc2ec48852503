"""Uniform cubic B-splines over the picture and in a micro-image, for kernels.

Source: C. de Boor, "A Practical Guide to Splines" (1978).
"""

import math

import numpy as np

from rig.arrays import Float
from rig.compute.kernel import kernel

MARGIN = 3
"""More coefficients than intervals, each way."""


@kernel()
def _weights(part: float, out: Float) -> None:
    """Write the weights (4,) of four coefficients, at a part (0 to 1) of the middle interval."""
    rest = 1.0 - part
    out[0] = rest * rest * rest / 6.0
    out[1] = (4.0 - 6.0 * part * part + 3.0 * part * part * part) / 6.0
    out[2] = (4.0 - 6.0 * rest * rest + 3.0 * rest * rest * rest) / 6.0
    out[3] = part * part * part / 6.0


@kernel()
def _interval(place: float, count: int, out: Float) -> int:
    """Write the weights at a place (0 to 1 over all intervals); return the first coefficient."""
    intervals = count - 3
    at = min(max(place, 0.0), 1.0) * intervals
    first = min(math.floor(at), intervals - 1)
    _weights(at - first, out)
    return first


@kernel()
def across_picture(place_px: float, size_px: float, count: int, out: Float) -> int:
    """Write the weights at a column or row of the picture; return the first coefficient."""
    return _interval(place_px / max(size_px - 1.0, 1.0), count, out)


@kernel()
def across_cell(place_px: float, reach_px: float, count: int, out: Float) -> int:
    """Write the weights at a place in a micro-image; return the first coefficient."""
    return _interval((place_px + reach_px) / (2.0 * reach_px), count, out)


@kernel()
def combine(table: Float, size_px: Float, x_px: float, y_px: float, out: Float) -> None:
    """Write the table (n, n) of the micro-image at a place in the picture."""
    row, column = np.empty(4), np.empty(4)
    y = across_picture(y_px, size_px[1], table.shape[0], row)
    x = across_picture(x_px, size_px[0], table.shape[1], column)
    out[:] = 0.0
    for a in range(4):
        for b in range(4):
            weight = row[a] * column[b]
            for p in range(out.shape[0]):
                for q in range(out.shape[1]):
                    out[p, q] += weight * table[y + a, x + b, p, q]


@kernel()
def spread(cell: Float, size_px: Float, x_px: float, y_px: float, out: Float) -> None:
    """Add the table of one micro-image to those of the knots around it: transposed `combine`."""
    row, column = np.empty(4), np.empty(4)
    y = across_picture(y_px, size_px[1], out.shape[0], row)
    x = across_picture(x_px, size_px[0], out.shape[1], column)
    for a in range(4):
        for b in range(4):
            weight = row[a] * column[b]
            for p in range(cell.shape[0]):
                for q in range(cell.shape[1]):
                    out[y + a, x + b, p, q] += weight * cell[p, q]


@kernel()
def look(cell: Float, y: int, x: int, row: Float, column: Float) -> float:
    """Return the spline at a place, from the weights of `across_cell`."""
    light = 0.0
    for a in range(4):
        part = 0.0
        for b in range(4):
            part += column[b] * cell[y + a, x + b]
        light += row[a] * part
    return light


@kernel()
def brightest(cell: Float, reach_px: float, radius_px: float) -> float:
    """Return the most light inside a radius; coefficients themselves may be larger than it."""
    row, column = np.empty(4), np.empty(4)
    most = 0.0
    steps = math.floor(radius_px)
    for v in range(-steps, steps + 1):
        y = across_cell(v, reach_px, cell.shape[0], row)
        for u in range(-steps, steps + 1):
            if u * u + v * v <= radius_px * radius_px:
                x = across_cell(u, reach_px, cell.shape[1], column)
                most = max(most, look(cell, y, x, row, column))
    return most
