"""Tell from the markers between the corners of a lattice which corner is which."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.charuco.board import CharucoBoard
from rig.targets.charuco.cells import ReadCells, sample_cells

Picture = NDArray[np.float32]

_WRONG_SHARE = 0.13
"""Share of the bits of a marker that may be read wrongly."""
_AGREEING_SHARE = 0.6
"""Share of the readable markers on the board that must be the ones that belong there."""
_ONE_ASTRAY_OF = 30
"""So many that look like one of the board's allow one to be elsewhere: a board of the other
pattern agrees but for one marker in every second row."""
_MOST_CELLS = 400


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a lattice lies on a board."""

    quarters: int
    """Quarter turns (`np.rot90`) that bring it into the board's orientation."""
    row: int
    """Row, among the board's squares, of the turned lattice's first square."""
    column: int
    agreeing: int
    """Markers read that are where the board has them."""


def place_lattice(picture: Picture, xy_px: Float, board: CharucoBoard) -> Placing | None:
    """Return where a lattice (R, C, 2) of corners lies on a board; None where no marker says."""
    cells = sample_cells(picture, xy_px, bits_across=board.bits_across, share=board.marker_share)
    return place_on_board(cells.read(), board.marker_numbers, board.marker_bits)


def place_on_board(
    cells: ReadCells, numbers: NDArray[np.intp], markers: NDArray[np.bool_]
) -> Placing | None:
    """Return where the markers that were read lie on a board; None where they do not.

    Every marker that looks like one of the board's proposes a place; the place at which most of
    the readable markers agree is taken, if they are enough of those that should.

    Args:
        cells: what was read.
        numbers: (rows, columns) of the board's squares: number of their marker, -1 for none.
        markers: (M, n, n) inner bits, True for white.
    """
    if not cells.readable.any():
        return None
    side = markers.shape[1]
    flat = markers.reshape(len(markers), -1)
    allowed = int(_WRONG_SHARE * side * side)
    found: list[tuple[int, int, Placing]] = []
    order = np.arange(len(cells.readable)).reshape(cells.shape)
    for quarters in range(4):
        seen = np.flatnonzero(cells.readable)[:_MOST_CELLS]
        bits = np.rot90(cells.bits[seen], quarters, axes=(1, 2)).reshape(len(seen), flat.shape[1])
        wrong = _differences(bits, flat)
        turned = np.rot90(order, quarters)
        where = np.argsort(turned.ravel(), kind="stable")
        place = np.stack(np.divmod(where[seen], turned.shape[1]), axis=-1)
        found += _placings(place, wrong, numbers, allowed, quarters)
    if not found:
        return None
    return max(found, key=lambda entry: (entry[0], -entry[1]))[2]


def known_markers(cells: ReadCells, markers: NDArray[np.bool_]) -> dict[tuple[int, int], int]:
    """Return the numbers of markers read without a wrong bit, by row and column of their square.

    Rows and columns are those of the lattice after the turn in which most markers are upright.
    """
    if not cells.readable.any():
        return {}
    flat = markers.reshape(len(markers), -1)
    order = np.arange(len(cells.readable)).reshape(cells.shape)
    best: dict[tuple[int, int], int] = {}
    for quarters in range(4):
        seen = np.flatnonzero(cells.readable)[:_MOST_CELLS]
        bits = np.rot90(cells.bits[seen], quarters, axes=(1, 2)).reshape(len(seen), flat.shape[1])
        square, number = np.nonzero(_differences(bits, flat) == 0)
        turned = np.rot90(order, quarters)
        where = np.argsort(turned.ravel(), kind="stable")[seen[square]]
        found = {
            (int(at // turned.shape[1]), int(at % turned.shape[1])): int(n)
            for at, n in zip(where, number, strict=True)
        }
        if len(found) > len(best):
            best = found
    return best


def _differences(bits: NDArray[np.bool_], markers: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(S, M) number of bits in which squares and markers differ."""
    a, b = bits.astype(np.float32), markers.astype(np.float32)
    both = a @ b.T
    return np.rint(a.sum(axis=1)[:, None] + b.sum(axis=1) - 2 * both).astype(np.intp)


def _placings(
    place: NDArray[np.intp],
    wrong: NDArray[np.intp],
    numbers: NDArray[np.intp],
    allowed: int,
    quarters: int,
) -> list[tuple[int, int, Placing]]:
    """Places that some marker proposes and enough agree to: (agreeing, wrong bits, place)."""
    rows, columns = np.nonzero(numbers >= 0)
    home = np.empty((len(rows), 2), np.intp)
    home[numbers[rows, columns]] = np.stack([rows, columns], axis=-1)
    cell, marker = np.nonzero(wrong <= allowed)
    if not len(cell):
        return []
    recognised = int((wrong <= allowed).any(axis=1).sum())
    offsets, votes = np.unique(home[marker] - place[cell], axis=0, return_counts=True)
    good: list[tuple[int, int, Placing]] = []
    for index in np.argsort(-votes, kind="stable")[:8]:
        row, column = (int(number) for number in offsets[index])
        at = place + offsets[index]
        number = _numbers_at(numbers, at)
        expected = number >= 0
        bits_wrong = np.where(expected, wrong[np.arange(len(place)), number], 0)
        agrees = expected & (bits_wrong <= allowed)
        agreeing, total_wrong = int(agrees.sum()), int(bits_wrong[agrees].sum())
        enough = agreeing >= _AGREEING_SHARE * int(expected.sum())
        enough &= recognised - agreeing <= recognised // _ONE_ASTRAY_OF
        if enough and (agreeing > 1 or total_wrong == 0):
            good.append((agreeing, total_wrong, Placing(quarters, row, column, agreeing)))
    return good


def _numbers_at(numbers: NDArray[np.intp], at: NDArray[np.intp]) -> NDArray[np.intp]:
    """(S,) numbers of the markers at rows and columns (S, 2) of the board; -1 beyond it."""
    padded = np.pad(numbers, 1, constant_values=-1)
    inside = np.clip(at + 1, 0, np.array(padded.shape) - 1)
    return padded[inside[:, 0], inside[:, 1]]
