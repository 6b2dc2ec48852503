"""From micro-images with numbers to the lattice behind them, and what is wrong with single ones."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.lenslet.assign import Basis, Numbered, find_basis, number_spots
from rig.lenslet.lattice import DEGREES, Lattice, LatticeKind, terms
from rig.lenslet.spots import Spots, find_spots

_SPACING_WITHIN = 0.1
"""The profile's spacing may be off by this part; more is another camera, or another lattice."""
_ROUNDS = 4
_CLIPPED_AT = 4.0
_MAD = 1.4826
_FLOOR_PX = 0.02
"""What the grid of the pixels may do to a centre, in waves over the picture: no distortion."""
_DIRTY_LIGHT = 0.85
"""A lenslet that gives less than this part of its neighbours' light is dirty."""
_DIRTY_ASTRAY = 0.05
"""A micro-image that lies off the lattice by more than this, in spacings, is of a dirty lenslet."""
_MOST_UNUSABLE = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class FittedLattice:
    """A lattice, and the lenslets that do not take part."""

    lattice: Lattice
    missing: tuple[tuple[int, int], ...]
    """(i, j) of lenslets inside the picture that show no micro-image."""
    dirty: tuple[tuple[int, int], ...]
    """(i, j) of lenslets that are too dark, or whose micro-image lies elsewhere."""
    seen: int
    """Micro-images that were found."""
    used: int
    """Of them in the fit."""


def fit_lattice(white: NDArray[np.float32], kind: LatticeKind, spacing_px: float) -> FittedLattice:
    """Find the lattice of a white picture.

    Args:
        white: (H, W) light without dark level, colours brought to one grey.
        kind: of the lattice.
        spacing_px: between neighbouring micro-images, to 10 %.

    Raises:
        CalibrationError: there is no lattice, or another one.
    """
    height_px, width_px = white.shape
    size_px = (width_px, height_px)
    spots = find_spots(white, spacing_px)
    basis = find_basis(spots.centre_px, size_px)
    _require_same(basis, kind, spacing_px)
    numbered = number_spots(spots.centre_px, size_px, basis)
    seen = spots.centre_px[numbered.spot]
    whole = _without_gaps_beside(seen, basis)
    lattice, kept = _best(numbered, seen, whole, kind, size_px)
    missing = _missing(lattice, numbered, size_px)
    dirty = _dirty(lattice, numbered, seen, spots)
    expected = len(numbered.i) + len(missing)
    unusable = len(missing) + len(dirty)
    if unusable > _MOST_UNUSABLE * expected:
        raise CalibrationError(
            f"{len(missing)} of {expected} lenslets show no micro-image in the white picture and "
            f"{len(dirty)} are dark or displaced, at most {100 * _MOST_UNUSABLE:.0f} % may",
            advice="clean the array, light the white surface evenly, or correct camera.spacing_px",
        )
    return FittedLattice(lattice, missing, dirty, len(numbered.i), int(kept.sum()))


def _require_same(basis: Basis, kind: LatticeKind, spacing_px: float) -> None:
    if basis.kind != kind:
        raise CalibrationError(
            f'camera.lattice = "{kind}" asked for, the white picture shows a {basis.kind} lattice '
            f"of {basis.spacing_px:.2f} px",
            advice=f'set camera.lattice = "{basis.kind}", or give the white picture of this camera',
        )
    if abs(basis.spacing_px / spacing_px - 1.0) > _SPACING_WITHIN:
        raise CalibrationError(
            f"micro-images lie {basis.spacing_px:.2f} px apart in the white picture, "
            f"camera.spacing_px is {spacing_px:g} px",
            advice="correct camera.spacing_px, or give the white picture of this camera",
        )


def _without_gaps_beside(seen: Float, basis: Basis) -> NDArray[np.bool_]:
    """Whether all neighbours are there: the light of a lone side pulls a peak towards it."""
    order = 6 if basis.kind == "hexagonal" else 4
    counts = KDTree(seen).query_ball_point(seen, 1.25 * basis.spacing_px, return_length=True)
    whole = np.asarray(counts) >= order + 1
    return whole if whole.mean() > 0.5 else np.ones(len(seen), np.bool_)


def _best(
    numbered: Numbered,
    seen: Float,
    whole: NDArray[np.bool_],
    kind: LatticeKind,
    size_px: tuple[int, int],
) -> tuple[Lattice, NDArray[np.bool_]]:
    """The polynomial that the micro-images pay for (G. Schwarz, Annals of Statistics 6, 1978)."""
    blank = Lattice(kind, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 1.0, 0.0, 0.0)
    s, t = blank.places(numbered.i.astype(np.float64), numbered.j.astype(np.float64))
    reach = float(np.hypot(s, t).max())
    tried: list[tuple[float, Lattice, NDArray[np.bool_]]] = []
    for degree in DEGREES:
        powers = terms(s / reach, t / reach, degree)
        if tried and whole.sum() < 4 * powers.shape[1]:
            break
        solution, kept = _robust(powers, seen, whole)
        error = seen - powers @ solution
        scatter_px = _MAD * float(np.median(np.abs(error[whole])))
        square = np.minimum((error[whole] / max(_CLIPPED_AT * scatter_px, 1e-12)) ** 2, 1.0)
        misfit_px2 = float(square.mean()) * (_CLIPPED_AT * scatter_px) ** 2
        cost = square.size * math.log(misfit_px2 + _FLOOR_PX**2)
        cost += 2.0 * powers.shape[1] * math.log(square.size)
        x, y = solution.T.tolist()
        draft = Lattice(kind, tuple(x), tuple(y), reach, scatter_px, 0.0)
        sigma_px = _corner_sigma_px(draft, powers[kept], size_px, degree)
        tried.append((cost, replace(draft, sigma_px=sigma_px), kept))
    _, lattice, kept = min(tried, key=lambda one: one[0])
    return lattice, kept


def _robust(
    powers: Float, seen: Float, whole: NDArray[np.bool_]
) -> tuple[Float, NDArray[np.bool_]]:
    kept: NDArray[np.bool_] = whole
    solution = _solved(powers, seen, kept)
    for _ in range(_ROUNDS):
        error = np.abs(seen - powers @ solution).max(axis=1)
        kept = whole & (error <= max(2.0 * _CLIPPED_AT * float(np.median(error[whole])), 1e-9))
        solution = _solved(powers, seen, kept)
    return solution, kept


def _solved(powers: Float, seen: Float, kept: NDArray[np.bool_]) -> Float:
    return np.linalg.lstsq(powers[kept], seen[kept], rcond=None)[0].astype(np.float64)


def _corner_sigma_px(
    lattice: Lattice, powers: Float, size_px: tuple[int, int], degree: int
) -> float:
    width_px, height_px = size_px
    corners = np.array([[x, y] for x in (0, width_px - 1) for y in (0, height_px - 1)], np.float64)
    s, t = lattice.places(*lattice.numbers(corners))
    at = terms(s / lattice.reach, t / lattice.reach, degree)
    spread = np.linalg.solve(powers.T @ powers, at.T)
    return lattice.residual_px * math.sqrt(float(np.einsum("nk,kn->n", at, spread).max()))


def _missing(
    lattice: Lattice, numbered: Numbered, size_px: tuple[int, int]
) -> tuple[tuple[int, int], ...]:
    i, j, centre_px = lenslets_inside(lattice, size_px, margin_px=lattice.spacing_px)
    del centre_px
    there = set(zip(numbered.i.tolist(), numbered.j.tolist(), strict=True))
    return tuple(one for one in zip(i.tolist(), j.tolist(), strict=True) if one not in there)


def lenslets_inside(
    lattice: Lattice, size_px: tuple[int, int], *, margin_px: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float]:
    """Return i and j (N,) and centres (N, 2) of all lenslets farther than a margin from the border.

    Args:
        lattice: where they lie.
        size_px: width and height of the picture.
        margin_px: between centre and border.
    """
    width_px, height_px = size_px
    edge_x, edge_y = np.linspace(0, width_px - 1, 9), np.linspace(0, height_px - 1, 9)
    around = np.array([[x, y] for x in edge_x for y in edge_y])
    i, j = lattice.numbers(around)
    i, j = np.meshgrid(
        np.arange(math.floor(i.min()), math.ceil(i.max()) + 1),
        np.arange(math.floor(j.min()), math.ceil(j.max()) + 1),
    )
    i, j = i.ravel(), j.ravel()
    centre_px = lattice.centres_px(i, j)
    last = np.array([width_px - 1, height_px - 1])
    inside = np.all((centre_px >= margin_px) & (centre_px <= last - margin_px), axis=1)
    return i[inside], j[inside], centre_px[inside]


def _dirty(
    lattice: Lattice, numbered: Numbered, seen: Float, spots: Spots
) -> tuple[tuple[int, int], ...]:
    light = spots.light[numbered.spot]
    _, near = KDTree(seen).query(seen, k=min(13, len(seen)))
    is_dark = light < _DIRTY_LIGHT * np.median(light[near], axis=1)
    astray = np.linalg.norm(seen - lattice.centres_px(numbered.i, numbered.j), axis=1)
    odd = is_dark | (astray > max(_DIRTY_ASTRAY * lattice.spacing_px, 8.0 * lattice.residual_px))
    return tuple(zip(numbered.i[odd].tolist(), numbered.j[odd].tolist(), strict=True))
