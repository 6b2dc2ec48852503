"""At which sides of a lattice a checkerboard ends: there are outer squares, and paper beyond."""

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.lattice import Lattice
from rig.targets.pyramid import Picture
from rig.targets.saddles import bilinear

_MIDDLE, _BEFORE, _BEYOND = 0.5, 0.85, 1.15
"""Steps beyond the last line of corners at which outer squares are looked at: in their middle, and
just before and just beyond their own end, which whatever covers a board meets by chance only."""
_CLEAR = 0.4
"""Distance from the middle grey, in half contrasts, at which a square has a colour."""
_FEWEST = 3
"""Outer squares that must be seen on a side..."""
_ENDING = 0.75
"""...and share of them that must end where they should."""


def ended_sides(picture: Picture, lattice: Lattice) -> tuple[bool, bool, bool, bool]:
    """Tell at which sides (top, right, bottom, left of the lattice's array) the board ends.

    A side that is covered, out of the picture or without white paper around it is not told.

    Args:
        picture: (H, W) grey.
        lattice: in px of the picture; NaN where no corner was found.
    """
    top, right, bottom, left = (
        _ends_above(picture, np.rot90(lattice.xy_px, quarter)) for quarter in range(4)
    )
    return top, right, bottom, left


def _ends_above(picture: Picture, xy_px: Float) -> bool:
    """Whether the board ends above the first row of (R, C, 2) corners."""
    if len(xy_px) < 3:
        return False
    # Squares between two columns whose first three corners are all known.
    known = np.isfinite(xy_px[:3, :, 0]).all(axis=0)
    square = np.flatnonzero(known[:-1] & known[1:])
    inner = _look(picture, xy_px, square, -_MIDDLE)
    sign = np.where(square % 2 == 0, 1.0, -1.0)
    bright, dark = inner[sign > 0], inner[sign < 0]
    if len(square) < _FEWEST or not (len(bright) and len(dark)):
        return False
    middle = (np.median(bright) + np.median(dark)) / 2
    half = (np.median(bright) - np.median(dark)) / 2
    if half == 0:
        return False
    # Outer squares have the other colour than the inner ones beside them.
    white = sign * half < 0
    outer, before, beyond = (
        (_look(picture, xy_px, square, steps) - middle) / abs(half)
        for steps in (_MIDDLE, _BEFORE, _BEYOND)
    )
    seen = np.where(white, outer, -outer) > _CLEAR
    seen &= np.isfinite(beyond)
    ending = seen & (beyond > np.where(white, _CLEAR, 0.0)) & (white | (before < 0.0))
    of_both = bool(seen[white].any() and seen[~white].any())
    return of_both and seen.sum() >= _FEWEST and ending.sum() >= _ENDING * seen.sum()


def _look(picture: Picture, xy_px: Float, square: NDArray[np.intp], steps: float) -> Float:
    """Grey (S,) of squares above the first row, so many steps beyond it; NaN out of view.

    The next places follow from three corners: a wide lens bends the lines.
    """
    first, second, third = xy_px[:3]
    bend = first - 2 * second + third
    line = first + steps * (first - second) + steps * (steps + 1) / 2 * bend
    place = (line[square] + line[square + 1]) / 2
    last = np.array(picture.shape[::-1]) - 1
    within = np.clip(place, 0, last)
    grey = bilinear(picture, within)
    return np.where((within == place).all(axis=1), grey, np.nan)
