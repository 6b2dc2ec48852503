"""How much light reaches the pixels of a micro-image, and how that changes over the picture."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.lenslet.lattice import Lattice
from rig.lenslet.spline import MARGIN, across_cell, combine, look, spread

_KNOTS_PER_SPACING = 14
_REACH = 0.55
"""Half the side of the table of a micro-image, in spacings."""
_LENSLETS_PER_KNOT = 12
_MOST_KNOTS = 6
"""Intervals over the picture, each way; few enough that noise averages out."""
_MOST_LENSLETS = 10_000
"""Enough to fit; of more, every second, third ... is taken."""
_STEPS = 25
_RIDGE = 3e-4
"""What keeps coefficients at 0 that no pixel reaches, over the mean weight of all."""
_ENOUGH = 1e-9
_DIGITS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Vignetting:
    """Light of a white surface as a cubic spline of four coordinates.

    Two are the centre of the micro-image in the picture, two the place in the micro-image, which
    follow the cat's eye from the middle to the corners.
    """

    size_px: tuple[int, int]
    """Width and height of the raw picture."""
    reach_px: float
    """The table goes from -reach to reach in a micro-image, each way."""
    levels: float
    """Light that counts as 1 in the table."""
    table: Float
    """(rows, columns, n, n) coefficients: knots over the picture, then in the micro-image."""

    def light(self, centre_px: Float, place_px: Float) -> Float:
        """Return the light at places in micro-images.

        Args:
            centre_px: (N, 2) centres of micro-images.
            place_px: (N, 2) away from them.
        """
        out = np.empty(len(centre_px))
        table = self.levels * self.table

        def work(start: int, stop: int) -> None:
            _look_at(
                table,
                np.array(self.size_px, np.float64),
                self.reach_px,
                centre_px[start:stop],
                place_px[start:stop],
                out[start:stop],
            )

        run_in_bands(work, len(out))
        return out


def fit_vignetting(white: NDArray[np.float32], lattice: Lattice, centre_px: Float) -> Vignetting:
    """Fit the light of a white picture, by conjugate gradients on the normal equations.

    Args:
        white: (H, W) light without dark level, colours brought to one grey.
        lattice: of the micro-images.
        centre_px: (N, 2) centres of those that take part, wholly inside the picture.
    """
    height_px, width_px = white.shape
    size_px = (width_px, height_px)
    reach_px = _REACH * lattice.spacing_px
    cells = math.ceil(2.0 * _REACH * _KNOTS_PER_SPACING)
    taken = centre_px[:: math.ceil(len(centre_px) / _MOST_LENSLETS)]
    across = math.sqrt(len(centre_px) * width_px / height_px)
    knots = [
        min(max(round(count / _LENSLETS_PER_KNOT), 1), _MOST_KNOTS)
        for count in (len(centre_px) / across, across)
    ]
    shape = (knots[0] + MARGIN, knots[1] + MARGIN, cells + MARGIN, cells + MARGIN)
    beside = _neighbours_px(lattice)
    size = np.array(size_px, np.float64)

    def normal(coefficients: Float, *, of_white: bool) -> Float:
        halves = np.zeros((2, *shape))

        def work(start: int, stop: int) -> None:
            for half in range(start, stop):
                _normal(
                    white,
                    size,
                    reach_px,
                    taken[half::2],
                    beside,
                    coefficients,
                    of_white,
                    halves[half],
                )

        run_in_bands(work, 2)
        return halves.sum(axis=0)

    aim = normal(np.zeros(shape), of_white=True)
    weight = normal(np.ones(shape), of_white=False)

    def of_all(cell: Float) -> Float:
        return normal(np.broadcast_to(cell, shape).copy(), of_white=False).sum(axis=(0, 1))

    # First what all micro-images share, then by how much they differ: where few pixels tell, the
    # ridge leaves a difference at 0, and not the light.
    shared = _solved(of_all, aim.sum(axis=(0, 1)), weight.sum(axis=(0, 1)))
    start = np.broadcast_to(shared, shape).copy()
    rest = aim - normal(start, of_white=False)
    table = start + _solved(lambda c: normal(c, of_white=False), rest, weight)
    levels = float(np.median(table[..., cells // 2, cells // 2]))
    return Vignetting(size_px, reach_px, levels, np.round(table / levels, _DIGITS))


def _solved(image_of: Callable[[Float], Float], aim: Float, weight: Float) -> Float:
    """Solve normal equations by conjugate gradients, with a ridge.

    Args:
        image_of: the normal matrix times coefficients.
        aim: right-hand side.
        weight: sums of the rows of the matrix: a diagonal that all its weights share.
    """
    ridge = _RIDGE * float(weight.sum()) / weight.size
    scale = 1.0 / np.sqrt(weight + ridge)
    solution, rest = np.zeros(aim.shape), aim * scale
    direction, square = rest.copy(), float(np.vdot(rest, rest))
    first = square
    for _ in range(_STEPS):
        if square <= _ENOUGH * first:
            break
        scaled = direction * scale
        image = (image_of(scaled) + ridge * scaled) * scale
        step = square / float(np.vdot(direction, image))
        solution += step * direction
        rest -= step * image
        square, before = float(np.vdot(rest, rest)), square
        direction = rest + square / before * direction
    return solution * scale


def _neighbours_px(lattice: Lattice) -> Float:
    """(K, 2) from a micro-image to its neighbours."""
    steps = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, -1), (-1, 1), (1, 1), (-1, -1)]
    middle = lattice.centres_px(np.zeros(1), np.zeros(1))
    number = np.array(steps, np.float64)
    return lattice.centres_px(number[:, 0], number[:, 1]) - middle


@kernel()
def _look_at(
    table: Float, size_px: Float, reach_px: float, centre_px: Float, place_px: Float, out: Float
) -> None:
    cell = np.empty((table.shape[2], table.shape[3]))
    row, column = np.empty(4), np.empty(4)
    for n in range(out.size):
        combine(table, size_px, centre_px[n, 0], centre_px[n, 1], cell)
        y = across_cell(place_px[n, 1], reach_px, cell.shape[0], row)
        x = across_cell(place_px[n, 0], reach_px, cell.shape[1], column)
        out[n] = look(cell, y, x, row, column)


@kernel()
def _normal(
    white: NDArray[np.float32],
    size_px: Float,
    reach_px: float,
    centre_px: Float,
    beside_px: Float,
    coefficients: Float,
    of_white: bool,
    out: Float,
) -> None:
    """Add A^T A c, or A^T w, where A gives the pixels of micro-images from the coefficients."""
    cell = np.empty((out.shape[2], out.shape[3]))
    back = np.empty((out.shape[2], out.shape[3]))
    row, column = np.empty(4), np.empty(4)
    for n in range(centre_px.shape[0]):
        x0, y0 = centre_px[n, 0], centre_px[n, 1]
        combine(coefficients, size_px, x0, y0, cell)
        back[:] = 0.0
        for v in range(math.ceil(y0 - reach_px), math.floor(y0 + reach_px) + 1):
            if v < 0 or v >= white.shape[0]:
                continue
            y = across_cell(v - y0, reach_px, cell.shape[0], row)
            for u in range(math.ceil(x0 - reach_px), math.floor(x0 + reach_px) + 1):
                if u < 0 or u >= white.shape[1]:
                    continue
                if not _is_own(u - x0, v - y0, beside_px):
                    continue
                x = across_cell(u - x0, reach_px, cell.shape[1], column)
                value = np.float64(white[v, u]) if of_white else look(cell, y, x, row, column)
                for a in range(4):
                    for b in range(4):
                        back[y + a, x + b] += value * row[a] * column[b]
        spread(back, size_px, x0, y0, out)


@kernel()
def _is_own(x_px: float, y_px: float, beside_px: Float) -> bool:
    """Whether a place away from a centre is nearer to it than to its neighbours."""
    for k in range(beside_px.shape[0]):
        bx, by = beside_px[k, 0], beside_px[k, 1]
        if x_px * bx + y_px * by > 0.5 * (bx * bx + by * by):
            return False
    return True
