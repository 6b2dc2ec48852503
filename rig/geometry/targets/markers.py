"""Read the markers between the corners of a lattice, and tell from them which corner is which."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.geometry.homography import fit_homography, grid_places, map_points
from rig.geometry.saddles import bilinear
from rig.geometry.targets.charuco_board import CharucoBoard

Float = NDArray[np.float64]
Picture = NDArray[np.float32]

_PLACES_IN_BIT = (-0.2, 0.2)
"""Where a bit is sampled, in bits from its middle."""
_BORDER_SHARE = 0.8
"""Share of the border's bits that must be black."""
_WHITER = 0.25
"""Least difference of margin and border, over the largest of a lattice."""
_WRONG_SHARE = 0.13
"""Share of the bits of a marker that may be read wrongly."""
_AGREEING_SHARE = 0.6
"""Share of the readable markers on the board that must be the ones that belong there."""
_ONE_ASTRAY_OF = 30
"""So many that look like one of the board's allow one to be elsewhere: a board of the other
pattern agrees but for one marker in every second row."""
_MOST_CELLS = 400


@dataclass(frozen=True, slots=True)
class ReadCells:
    """The squares of a lattice with one ring around it, and the bits read in them."""

    shape: tuple[int, int]
    """Rows and columns of squares: one more than of corners."""
    readable: NDArray[np.bool_]
    """(S,) whether a marker's border is there, row by row."""
    bits: NDArray[np.bool_]
    """(S, n, n) inner bits, True for white; rows and columns as on the lattice."""


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
    cells = read_cells(
        picture,
        xy_px,
        bits_across=board.bits_across,
        share=board.marker_mm / board.square_mm,
    )
    return place_on_board(cells, board.marker_numbers, board.marker_bits)


def padded_grid(xy_px: Float) -> Float:
    """(R + 2, C + 2, 2) corners with missing ones and a ring around filled in.

    A homography tells where they lie; next to the border it is corrected by what it misses the
    nearest corner by, so that distortion is followed.
    """
    found = np.isfinite(xy_px[..., 0])
    places = grid_places(*found.shape)
    homography = fit_homography(places[found], xy_px[found])
    apart = np.where(found[..., None], xy_px - map_points(homography, places), 0.0)
    ring = grid_places(found.shape[0] + 2, found.shape[1] + 2) - 1.0
    return map_points(homography, ring) + np.pad(apart, ((1, 1), (1, 1), (0, 0)), mode="edge")


def read_cells(picture: Picture, xy_px: Float, *, bits_across: int, share: float) -> ReadCells:
    """Sample the bits of a marker in every square.

    Args:
        picture: (H, W) grey, black markers on white.
        xy_px: (R, C, 2) corners of a lattice, NaN where none was found; at least 2 x 2.
        bits_across: bits of a marker with its border.
        share: side of a marker over the side of a square.
    """
    grid = padded_grid(xy_px)
    shape = (grid.shape[0] - 1, grid.shape[1] - 1)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2)
    square_from_unit = _homographies(quads.reshape(-1, 4, 2))
    bit = share / bits_across
    middles = 0.5 + bit * (np.arange(bits_across) - (bits_across - 1) / 2)
    fine = (middles[:, None] + bit * np.array(_PLACES_IN_BIT)).ravel()
    v, u = np.meshgrid(fine, fine, indexing="ij")
    grey, inside = _look(picture, square_from_unit, np.stack([u, v], axis=-1).reshape(-1, 2))
    per_bit = len(_PLACES_IN_BIT)
    levels = grey.reshape(-1, bits_across, per_bit, bits_across, per_bit).mean(axis=(2, 4))
    edge = (1 - share) / 4
    along = np.linspace(0.2, 0.8, 4)
    margin = [(edge, a) for a in along] + [(1 - edge, a) for a in along]
    around, _ = _look(picture, square_from_unit, np.array(margin + [(b, a) for a, b in margin]))
    return _threshold(shape, levels, np.median(around, axis=1), inside)


def _threshold(
    shape: tuple[int, int], levels: Float, white: Float, inside: NDArray[np.bool_]
) -> ReadCells:
    border = np.ones(levels.shape[1:], np.bool_)
    border[1:-1, 1:-1] = False
    black = np.median(levels[:, border], axis=1)
    middle = (white + black) / 2
    above = levels > middle[:, None, None]
    framed = (~above[:, border]).mean(axis=1) >= _BORDER_SHARE
    contrast = np.where(inside & framed, white - black, 0.0)
    readable = contrast > np.maximum(_WHITER * contrast.max(initial=0.0), 1e-6)
    return ReadCells(shape, readable, above[:, 1:-1, 1:-1])


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


def _homographies(quads: Float) -> Float:
    """(S, 3, 3) from the unit square to S quadrilaterals (S, 4, 2), clockwise from (0, 0).

    Closed form: P. Heckbert, "Fundamentals of Texture Mapping and Image Warping", 1989.
    """
    (x0, x1, x2, x3), (y0, y1, y2, y3) = quads[..., 0].T, quads[..., 1].T
    dx1, dx2, dx3 = x1 - x2, x3 - x2, x0 - x1 + x2 - x3
    dy1, dy2, dy3 = y1 - y2, y3 - y2, y0 - y1 + y2 - y3
    area = dx1 * dy2 - dx2 * dy1
    area = np.where(np.abs(area) > 1e-9, area, 1e-9)
    g, h = (dx3 * dy2 - dx2 * dy3) / area, (dx1 * dy3 - dx3 * dy1) / area
    one = np.ones_like(g)
    rows = [
        [x1 - x0 + g * x1, x3 - x0 + h * x3, x0],
        [y1 - y0 + g * y1, y3 - y0 + h * y3, y0],
        [g, h, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def _look(
    picture: Picture, square_from_unit: Float, unit: Float
) -> tuple[Float, NDArray[np.bool_]]:
    """Grey (S, P) at places (P, 2) of unit squares, and whether all of a square is in view."""
    points = np.concatenate([unit, np.ones((len(unit), 1))], axis=1)
    mapped = points @ square_from_unit.transpose(0, 2, 1)
    xy_px = mapped[..., :2] / np.where(np.abs(mapped[..., 2:]) > 1e-9, mapped[..., 2:], 1e-9)
    last = np.array(picture.shape[::-1]) - 1
    within = np.clip(xy_px, 0, last)
    return bilinear(picture, within), np.asarray((within == xy_px).all(axis=(1, 2)))
