"""Which lenslet a micro-image belongs to: numbers that grow from the middle outwards."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.lenslet.lattice import ROW_SHIFT, ROW_SPACING, LatticeKind, terms

_FEWEST = 30
"""Micro-images below which there is no lattice to speak of."""
_BEGINS_WITHIN = 5.0
"""Spacings around the middle that are numbered by the basis alone."""
_GROWTH = 1.5
_NEAR = 0.3
"""A micro-image farther from its place than this, in spacings, has no number."""
_MOST_ASTRAY = 0.1
_NEIGHBOURS: dict[LatticeKind, int] = {"hexagonal": 6, "square": 4}


@dataclass(frozen=True, slots=True, eq=False)
class Numbered:
    """Spots with the numbers of their lenslets."""

    i: NDArray[np.int64]
    """(N,) number within the row."""
    j: NDArray[np.int64]
    """(N,) row."""
    spot: NDArray[np.int64]
    """(N,) which spot it is."""


@dataclass(frozen=True, slots=True)
class Basis:
    """The lattice in the middle of the picture."""

    kind: LatticeKind
    spacing_px: float
    rotation_rad: float


def find_basis(centre_px: Float, size_px: tuple[int, int]) -> Basis:
    """Return kind, spacing and rotation from the nearest neighbours in the middle.

    Raises:
        CalibrationError: there is no lattice.
    """
    middle_px = np.array(size_px) / 2.0
    inner = np.all(np.abs(centre_px - middle_px) < middle_px / 2.0, axis=1)
    if len(centre_px) < _FEWEST or inner.sum() < _FEWEST // 2:
        raise CalibrationError(
            f"found {len(centre_px)} micro-images in the white picture, a lattice needs {_FEWEST}",
            advice="correct camera.spacing_px, or give a picture of an evenly lit white surface",
        )
    tree = KDTree(centre_px)
    found = tree.query(centre_px[inner], k=9)
    distances_px, others = np.asarray(found[0]), np.asarray(found[1])
    spacing_px = float(np.median(distances_px[:, 1:3]))
    is_near = (distances_px > 0.0) & (distances_px < 1.2 * spacing_px)
    count = int(np.median(is_near.sum(axis=1)))
    kind: LatticeKind = "hexagonal" if count >= 5 else "square"
    away = centre_px[others] - centre_px[inner][:, None]
    angle_rad = np.arctan2(away[..., 1], away[..., 0])[is_near]
    order = _NEIGHBOURS[kind]
    turned = complex(np.exp(1j * order * angle_rad).mean())
    if abs(turned) < 0.5:
        raise CalibrationError(
            f"found {len(centre_px)} bright places {spacing_px:.1f} px apart, in no order",
            advice="give a white picture: sharp, evenly lit, of this camera; correct "
            "camera.spacing_px",
        )
    spacing_px = float(np.median(distances_px[is_near]))
    return Basis(kind, spacing_px, math.atan2(turned.imag, turned.real) / order)


def number_spots(centre_px: Float, size_px: tuple[int, int], basis: Basis) -> Numbered:
    """Give every micro-image its lenslet; the lattice is learnt as it grows.

    All at once by a basis that is a little wrong would be off by whole lenslets at the border.

    Raises:
        CalibrationError: too many micro-images have no place in the lattice.
    """
    origin_px = centre_px[np.argmin(np.linalg.norm(centre_px - np.array(size_px) / 2.0, axis=1))]
    away = (centre_px - origin_px) / basis.spacing_px
    cos, sin = math.cos(basis.rotation_rad), math.sin(basis.rotation_rad)
    place = away @ np.array([[cos, -sin], [sin, cos]])
    reach, farthest = _BEGINS_WITHIN, float(np.abs(away).max()) * math.sqrt(2.0)
    distance = np.linalg.norm(away, axis=1)
    while True:
        i, j, astray = _rounded(place, basis.kind)
        known = (distance <= reach) & (astray < _NEAR)
        if reach >= farthest:
            break
        place = _learnt(
            away,
            np.stack(_ideal(i.astype(np.float64), j.astype(np.float64), basis.kind), axis=-1),
            known,
            reach,
        )
        reach *= _GROWTH
    share = 1.0 - float(known.mean())
    if share > _MOST_ASTRAY:
        raise CalibrationError(
            f"{100.0 * share:.0f} % of {len(centre_px)} micro-images lie off the {basis.kind} "
            f"lattice of {basis.spacing_px:.2f} px that the middle has",
            advice="give a sharp white picture of this camera, without a scene",
        )
    spot = np.nonzero(known)[0]
    spot = spot[np.argsort(astray[spot], kind="stable")]
    _, first = np.unique(np.stack([i[spot], j[spot]]), axis=1, return_index=True)
    spot = np.sort(spot[first])
    return Numbered(i[spot], j[spot], spot)


def _rounded(place: Float, kind: LatticeKind) -> tuple[NDArray[np.int64], NDArray[np.int64], Float]:
    """The nearest lenslet of places (N, 2) on the array, and how far it is, in spacings."""
    j = np.rint(place[:, 1] / ROW_SPACING[kind])
    i = np.rint(place[:, 0] - ROW_SHIFT[kind] * j)
    astray = np.linalg.norm(place - np.stack(_ideal(i, j, kind), axis=-1), axis=1)
    return i.astype(np.int64), j.astype(np.int64), astray


def _ideal(i: Float, j: Float, kind: LatticeKind) -> tuple[Float, Float]:
    return i + ROW_SHIFT[kind] * j, ROW_SPACING[kind] * j


def _learnt(away: Float, ideal: Float, known: NDArray[np.bool_], reach: float) -> Float:
    """Places of all spots by a polynomial through those that are known."""
    degree = 1 if known.sum() < 300 else 3
    powers = terms(away[:, 0] / reach, away[:, 1] / reach, degree)
    solution = np.linalg.lstsq(powers[known], ideal[known], rcond=None)[0]
    return powers @ solution
