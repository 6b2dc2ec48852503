"""Where a lattice of corners lies on a checkerboard, of which it may be a part."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.homography import fit_homography, grid_places, map_points
from rig.targets.checkerboard import Checkerboard
from rig.targets.lattice import Lattice
from rig.targets.outline import Sides

_NEAREST = 24
"""Corners about a missing one that tell where it is..."""
_EXPONENTS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))
"""...by a homography, and by these powers of row and column for what a lens bends beyond it..."""
_FEWEST_EACH = 1.5
"""...of which there are none without so many corners for each."""


@dataclass(frozen=True, slots=True)
class Place:
    """One way in which a lattice may lie on a board."""

    lattice: Lattice
    """Turned into the board's orientation."""
    row: int
    """Row, among the board's corners, of the lattice's first one."""
    column: int

    def on_board(self, board: Checkerboard) -> Float:
        """(rows, columns, 2) corners, NaN where the lattice has none."""
        rows, columns = self.lattice.shape
        xy_px = np.full((board.rows, board.columns, 2), np.nan)
        xy_px[self.row : self.row + rows, self.column : self.column + columns] = self.lattice.xy_px
        return xy_px


def turns(lattice: Lattice) -> Iterator[Lattice]:
    """The lattice in its four orientations, each a quarter turn (`np.rot90`) on."""
    for quarter in range(4):
        yield Lattice(np.rot90(lattice.xy_px, quarter), np.rot90(lattice.bright, quarter))


def certain_place(lattice: Lattice, board: Checkerboard, ends: Sides) -> Place | None:
    """Return where a lattice lies on a board, colours and ends in place; None if it is not certain.

    There is one way only, and the lattice is as long as the board one way: the other way it is so
    too, or it ends where the board does. One end at least is seen: a stretch of a floor with
    chequered tiles has a place as well. Of ways that the board itself cannot tell apart, because it
    looks the same after a turn, the one counts whose corner (0, 0) is nearest the top left of the
    picture.

    Args:
        lattice: not larger than the board, or there is no way.
        board: what was asked for.
        ends: sides of the lattice at which the board is known to end.
    """
    if not any(ends):
        return None
    found: dict[bytes, list[Place]] = {}
    number = np.arange(lattice.found.size).reshape(lattice.shape)
    for quarter, turned in enumerate(turns(lattice)):
        spare_rows, spare_columns = np.subtract((board.rows, board.columns), turned.shape).tolist()
        if min(spare_rows, spare_columns) < 0:
            continue
        # A quarter turn brings the right side to the top.
        top, right, bottom, left = ends[quarter:] + ends[:quarter]
        is_black = black_first(turned)
        for row in _offsets(spare_rows, top, bottom):
            for column in _offsets(spare_columns, left, right):
                if ((row + column) % 2 == 0) != is_black:
                    continue
                spare = ((row, spare_rows - row), (column, spare_columns - column))
                whole = np.pad(np.rot90(number, quarter), spare, constant_values=-1)
                alike = min(np.rot90(whole, turn).tobytes() for turn in _looks_the_same(board))
                found.setdefault(alike, []).append(Place(turned, row, column))
    if len(found) != 1:
        return None
    (ways,) = found.values()
    rows, columns = ways[0].lattice.shape
    if rows != board.rows and columns != board.columns:
        return None
    return min(ways, key=lambda way: _begins_px(way, board))


def _looks_the_same(board: Checkerboard) -> tuple[int, ...]:
    """Quarter turns after which a board looks as before."""
    if board.has_one_way_up:
        return (0,)
    return (0, 1, 2, 3) if board.rows == board.columns and board.rows % 2 == 0 else (0, 2)


def _begins_px(place: Place, board: Checkerboard) -> float:
    return float(completed(place.on_board(board))[0, 0].sum())


def _offsets(spare: int, first_is_end: bool, last_is_end: bool) -> list[int]:
    """Places along one axis that leave no corner beyond an end."""
    offsets = list(range(spare + 1))
    if first_is_end:
        offsets = [at for at in offsets if at == 0]
    return [at for at in offsets if at == spare] if last_is_end else offsets


def black_first(lattice: Lattice) -> bool:
    """Whether the square outside corner (0, 0) is black, by vote of all corners."""
    down = np.nanmean(np.diff(lattice.xy_px, axis=0), axis=(0, 1))
    right = np.nanmean(np.diff(lattice.xy_px, axis=1), axis=(0, 1))
    angle = 2 * np.arctan2(*(down / np.hypot(*down) + right / np.hypot(*right))[::-1])
    towards = lattice.bright @ np.array([np.cos(angle), np.sin(angle)])
    row, column = np.indices(towards.shape)
    return float(np.nansum(np.where((row + column) % 2 == 0, towards, -towards))) < 0


def completed(xy_px: Float) -> Float:
    """Missing corners where the nearest others put them.

    Through all of them a wide lens would put it far off; so would a homography alone at the rim of
    a fisheye, where lines bend from one square to the next.
    """
    found = np.isfinite(xy_px[..., 0])
    places = grid_places(*found.shape)
    whole = xy_px.copy()
    for place in np.argwhere(~found):
        there = places[tuple(place)]
        apart = np.linalg.norm(places[found] - there, axis=1)
        near = np.argsort(apart, kind="stable")[:_NEAREST]
        known, known_px = places[found][near], xy_px[found][near]
        homography = fit_homography(known, known_px)
        bent_px = known_px - map_points(homography, known)
        straight_px = map_points(homography, there[None])[0]
        whole[tuple(place)] = straight_px + _at_origin(known - there, bent_px)
    return whole


def _at_origin(places: Float, values: Float) -> Float:
    """What a smooth polynomial through (N, 2) values at (N, 2) places has at place (0, 0)."""
    order = next(n for n in (3, 2, 0) if _terms(n) * _FEWEST_EACH <= len(places) or n == 0)
    if order == 0:
        return np.zeros(values.shape[1])
    powers = _EXPONENTS[: _terms(order)]
    rows = np.stack([places[:, 0] ** i * places[:, 1] ** j for i, j in powers], axis=1)
    return np.asarray(np.linalg.lstsq(rows, values, rcond=1e-9)[0][0], np.float64)


def _terms(order: int) -> int:
    return (order + 1) * (order + 2) // 2
