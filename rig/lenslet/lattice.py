"""Where the micro-images of a lenslet array lie on the sensor."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

Numbers = NDArray[np.integer[Any]] | NDArray[np.floating[Any]]
"""Numbers of lenslets, whole ones or with fractions."""
LatticeKind = Literal["hexagonal", "square"]

ROW_SPACING = {"hexagonal": math.sqrt(3.0) / 2.0, "square": 1.0}
"""From row to row of lenslets, in spacings."""
ROW_SHIFT = {"hexagonal": 0.5, "square": 0.0}
"""By how much the next row lies to the right, in spacings."""
DEGREES = (1, 3, 5)
"""Polynomials that a lattice may be: straight, or with a distortion that is as smooth as a lens."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """Centres of all micro-images: a regular lattice, seen through a smooth distortion.

    A lenslet has the number i within row j; (0, 0) lies near the middle of the picture. Its place
    on the array is `(s, t) = (i + shift j, spacing j)`, in spacings, see `ROW_SHIFT` and
    `ROW_SPACING`; its micro-image is where two polynomials of (s, t) have it.
    """

    kind: LatticeKind
    x_px: tuple[float, ...]
    """Coefficients of the column, in the order of `terms`."""
    y_px: tuple[float, ...]
    """Coefficients of the row."""
    reach: float
    """Distance on the array that counts as 1 in the polynomials, in spacings."""
    residual_px: float
    """Robust scatter of single micro-images around it, 1 sigma of each coordinate."""
    sigma_px: float
    """1 sigma of a centre in the worst corner of the picture, each coordinate."""

    def places(self, i: Numbers, j: Numbers) -> tuple[Float, Float]:
        """Return (s, t) of lenslets on the array, in spacings."""
        i, j = np.asarray(i, np.float64), np.asarray(j, np.float64)
        return i + ROW_SHIFT[self.kind] * j, ROW_SPACING[self.kind] * j

    def centres_px(self, i: Numbers, j: Numbers) -> Float:
        """Return centres (..., 2) of micro-images, columns and rows, pixel centres at integers."""
        s, t = self.places(i, j)
        powers = terms(s / self.reach, t / self.reach, _degree(len(self.x_px)))
        return np.stack([powers @ np.array(self.x_px), powers @ np.array(self.y_px)], axis=-1)

    @property
    def jacobian_px(self) -> Float:
        """(2, 2) change of a centre with (s, t) at lenslet (0, 0), px per spacing."""
        first = [1, 2]
        return np.stack([np.array(self.x_px)[first], np.array(self.y_px)[first]]) / self.reach

    @property
    def spacing_px(self) -> float:
        """Distance between neighbouring micro-images in the middle."""
        return math.sqrt(abs(float(np.linalg.det(self.jacobian_px))))

    @property
    def rotation_rad(self) -> float:
        """Angle of the rows of lenslets, from the picture's rows towards its columns."""
        (xs, xt), (ys, yt) = self.jacobian_px.tolist()
        return math.atan2(ys - xt, xs + yt)

    def numbers(self, place_px: Float) -> tuple[Float, Float]:
        """Return numbers (i, j) with fractions of places (..., 2) in the picture, by Newton."""
        place_px = np.asarray(place_px, np.float64)
        inverse = np.linalg.inv(self.jacobian_px)
        i, j = np.zeros(place_px.shape[:-1]), np.zeros(place_px.shape[:-1])
        for _ in range(12):  # the distortion is weak: every step gains two digits
            s, t = np.moveaxis((place_px - self.centres_px(i, j)) @ inverse.T, -1, 0)
            more = t / ROW_SPACING[self.kind]
            i, j = i + s - ROW_SHIFT[self.kind] * more, j + more
        return i, j


def terms(s: Float, t: Float, degree: int) -> Float:
    """Return all products of powers (..., n) up to a degree: 1, s, t, s^2, s t, t^2, ..."""
    powers = [s ** (n - k) * t**k for n in range(degree + 1) for k in range(n + 1)]
    return np.stack(powers, axis=-1)


def _degree(count: int) -> int:
    return next(d for d in DEGREES if (d + 1) * (d + 2) // 2 == count)
