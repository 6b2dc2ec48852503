"""The equations that the lines of many pixels give the places of views.

Grey value and slope of every pixel are unknowns of the same least squares. Two directions of its V
differences are what they explain; both are taken out pixel by pixel, as points are in a bundle
adjustment (B. Triggs, P. McLauchlan, R. Hartley and A. Fitzgibbon, "Bundle adjustment - a modern
synthesis", 1999).
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_side_by_side

UNKNOWNS = 4
"""Of a view: shift right and down, px; position right and down, view steps."""
_PRODUCTS_AT_ONCE = 150_000


@dataclass(frozen=True, slots=True)
class Lines:
    """What the lines of N pixels say in V views, sorted by half of the picture and by cell."""

    difference: Float
    """(N, V) grey value less that of the reference."""
    seen: NDArray[np.bool_]
    """(N, V)."""
    across: Float
    """(N,) slope of the grey value to the right, levels per px."""
    down: Float
    """(N,) and downwards."""
    slope_px: Float
    """(N,)."""
    half: int
    """How many of the pixels lie in the first half of the picture's cells."""
    cells: NDArray[np.intp]
    """(C,) first pixel of every cell."""

    @property
    def halves(self) -> tuple[slice, slice]:
        """The pixels of both halves."""
        return slice(self.half), slice(self.half, None)

    @property
    def design(self) -> Float:
        """(N, 4) what the unknowns of a view do to its difference."""
        both = np.stack([self.across, self.down], axis=1)
        return np.hstack([-both, self.slope_px[:, None] * both])

    def tilts(self, x_steps: Float, y_steps: Float) -> Float:
        """Return what a change of each pixel's slope does to its differences, (N, V)."""
        return -(self.across[:, None] * x_steps + self.down[:, None] * y_steps)


@dataclass(frozen=True, slots=True)
class Eliminated:
    """What the grey value and the slope of each pixel explain of its differences, (N, V) each."""

    root: Float
    """Of the weights."""
    grey: Float
    """Unit vectors, in differences times `root`."""
    slope: Float

    def rest(self, difference: Float) -> Float:
        """Return `root` times differences (N, V), without what is explained."""
        rest = self.root * difference
        for known in (self.grey, self.slope):
            rest -= known * np.einsum("nv,nv->n", known, rest)[:, None]
        return rest

    def part(self, pixels: slice) -> "Eliminated":
        """Return what some of the pixels explain."""
        return Eliminated(self.root[pixels], self.grey[pixels], self.slope[pixels])


def eliminate(weight: Float, tilt: Float) -> Eliminated:
    """Eliminate a grey value and a slope from the pixels.

    Args:
        weight: (N, V) of every difference.
        tilt: (N, V) what a change of the pixel's slope does to it.
    """
    root = np.sqrt(weight)
    grey = root / np.sqrt(weight.sum(axis=1) + 1e-9)[:, None]
    slope = root * tilt
    slope -= grey * np.einsum("nv,nv->n", grey, slope)[:, None]
    slope /= np.sqrt(np.einsum("nv,nv->n", slope, slope) + 1e-9)[:, None]
    return Eliminated(root, grey, slope)


def normal_equations_of_halves(
    lines: Lines, eliminated: Eliminated
) -> tuple[tuple[Float, Float], ...]:
    """Normal matrix (4 V, 4 V) and right side (4 V,) of each half, both on threads of their own."""
    design = lines.design
    return tuple(
        run_side_by_side(
            *(
                partial(_normal_equations, eliminated.part(h), design[h], lines.difference[h])
                for h in lines.halves
            )
        )
    )


def _normal_equations(
    eliminated: Eliminated, design: Float, difference: Float
) -> tuple[Float, Float]:
    """Normal matrix (4 V, 4 V) and right side (4 V) without slope and grey value of the pixels.

    Args:
        eliminated: what they explain.
        design: (N, 4) what the unknowns of a view do to its difference.
        difference: (N, V).
    """
    root = eliminated.root
    pixels, views = root.shape
    normal = np.zeros((views * UNKNOWNS, views * UNKNOWNS))
    for known in (eliminated.grey, eliminated.slope):
        wide = ((root * known)[:, :, None] * design[:, None, :]).reshape(pixels, -1)
        normal -= summed(wide, wide)
    own = summed(root**2, (design[:, :, None] * design[:, None, :]).reshape(pixels, -1))
    for i in range(views):
        here = slice(UNKNOWNS * i, UNKNOWNS * (i + 1))
        normal[here, here] += own[i].reshape(UNKNOWNS, UNKNOWNS)
    return normal, summed(root * eliminated.rest(difference), design).ravel()


def summed(one: Float, other: Float) -> Float:
    """Sum over the pixels of the products of what they have, (N, A) and (N, B): (A, B).

    In small parts, for which the linear algebra library starts no threads: they would wait for
    cores that others use, and add up in an order of their own.
    """
    width = one.shape[1] * other.shape[1]
    at_once = max(_PRODUCTS_AT_ONCE // width, 1)
    total = np.zeros((one.shape[1], other.shape[1]))
    for start in range(0, len(one), at_once):
        part = slice(start, start + at_once)
        total += one[part].T @ other[part]
    return total
