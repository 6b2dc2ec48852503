"""At which sides of a lattice a checkerboard ends: there are outer squares, and paper beyond."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.lattice import Lattice
from rig.targets.pyramid import Picture
from rig.targets.saddles import bilinear

Sides: TypeAlias = tuple[bool, bool, bool, bool]
"""Top, right, bottom and left of a lattice's array."""

_MIDDLE, _BEFORE, _BEYOND = 0.5, 0.85, 1.15
"""Steps beyond the last line of corners at which outer squares are looked at: in their middle, and
just before and just beyond their own end, which whatever covers a board meets by chance only."""
_NEXT = 1.25
"""Steps at which paper is still white around most boards, and a next square would have turned."""
_CLEAR = 0.4
"""Distance from the middle grey, in half contrasts, at which a square has a colour."""
_FEWEST = 3
"""Outer squares that must be seen on a side, if it has so many..."""
_MOST = 0.75
"""...and share of them that must agree."""


def ended_sides(picture: Picture, lattice: Lattice) -> Sides:
    """Tell at which sides the board ends.

    A side that is covered, out of the picture or without white paper around it is not told.

    Args:
        picture: (H, W) grey.
        lattice: in px of the picture; NaN where no corner was found.
    """
    top, right, bottom, left = (_ends(squares) for squares in _around(picture, lattice))
    return top, right, bottom, left


def goes_on(picture: Picture, lattice: Lattice) -> bool:
    """Whether the pattern goes on beyond the outer squares of some side: a part of a larger one.

    Args:
        picture: (H, W) grey.
        lattice: in px of the picture; NaN where no corner was found.
    """
    return any(_turns(squares) for squares in _around(picture, lattice))


@dataclass(frozen=True, slots=True)
class _OuterSquares:
    """What is seen of the outer squares of one side, in half contrasts from the middle grey."""

    white: NDArray[np.bool_]
    """(S,) which ones are white."""
    seen: NDArray[np.bool_]
    """(S,) which ones have their colour, and are in view up to their end."""
    before: Float
    """(S,) just before their end."""
    beyond: Float
    """(S,) just beyond it."""
    next: Float
    """(S,) where the next squares would be, were there any."""

    @property
    def can_tell(self) -> bool:
        """Whether enough is seen of both colours."""
        of_both = (self.seen & self.white).any() and (self.seen & ~self.white).any()
        return bool(of_both and self.seen.sum() >= min(_FEWEST, len(self.seen)))


def _ends(squares: _OuterSquares | None) -> bool:
    """Whether there is white beyond all, and black ones end where squares do."""
    if squares is None or not squares.can_tell:
        return False
    ending = squares.beyond > np.where(squares.white, _CLEAR, 0.0)
    ending &= squares.white | (squares.before < 0.0)
    return bool(ending[squares.seen].mean() >= _MOST)


def _turns(squares: _OuterSquares | None) -> bool:
    """Whether the colours turn once more."""
    if squares is None or not squares.can_tell:
        return False
    turned = np.where(squares.white, -squares.next, squares.next) > _CLEAR
    return bool(turned[squares.seen].mean() >= _MOST)


def _around(picture: Picture, lattice: Lattice) -> Iterator[_OuterSquares | None]:
    """The outer squares of the sides: top, right, bottom, left of the lattice's array."""
    for quarter in range(4):
        yield _above(picture, np.rot90(lattice.xy_px, quarter))


def _above(picture: Picture, xy_px: Float) -> _OuterSquares | None:
    """The squares above the first row of (R, C, 2) corners; None where no colours are known."""
    if len(xy_px) < 3:
        return None
    # Squares between two columns whose first three corners are all known.
    known = np.asarray(np.isfinite(xy_px[:3, :, 0]).all(axis=0))
    square = np.flatnonzero(known[:-1] & known[1:])
    inner, outer, before, beyond, following = _look(
        picture, xy_px[:3], square, np.array([-_MIDDLE, _MIDDLE, _BEFORE, _BEYOND, _NEXT])
    )
    is_even = square % 2 == 0
    if not is_even.any() or is_even.all():
        return None
    even, odd = _middle(inner[is_even]), _middle(inner[~is_even])
    if even == odd:
        return None
    # Outer squares have the other colour than the inner ones beside them.
    white = is_even == (even < odd)
    middle, half = (even + odd) / 2, abs(even - odd) / 2
    outer, before, beyond, following = (
        (grey - middle) / half for grey in (outer, before, beyond, following)
    )
    seen = (np.where(white, outer, -outer) > _CLEAR) & np.isfinite(beyond)
    return _OuterSquares(white, seen, before, beyond, following)


def _middle(grey: Float) -> float:
    """The upper median: of a few numbers in a tenth of the time of numpy's."""
    return float(np.sort(grey)[len(grey) // 2])


def _look(picture: Picture, lines_px: Float, square: NDArray[np.intp], steps: Float) -> Float:
    """Grey (K, S) of squares K steps beyond the first of three lines; NaN out of view.

    The next places follow from three corners: a wide lens bends the lines.
    """
    first, second, third = lines_px
    bend = first - 2 * second + third
    steps = steps[:, None, None]
    line = first + steps * (first - second) + steps * (steps + 1) / 2 * bend
    place = (line[:, square] + line[:, square + 1]) / 2
    within = np.clip(place, 0, np.array(picture.shape[::-1]) - 1)
    return np.where((within == place).all(axis=2), bilinear(picture, within), np.nan)
