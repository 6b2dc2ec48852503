"""Finds the field term of a sweep from the slope planes of its flat board."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.curve.field import FieldTerm
from rig.curve.points import same_distance

FEWEST_DISTANCES = 5


@dataclass(frozen=True, slots=True)
class BoardTilt:
    """How the slope changes over the board at one stop."""

    distance_mm: float
    per_px: tuple[float, float]
    """Change of the slope per px right and down."""
    sigma: tuple[float, float]
    """1 sigma from the images' noise."""


@dataclass(frozen=True, slots=True)
class FieldFit:
    """What the slope planes of a sweep say together."""

    tilt_mm: tuple[float, float]
    """-p times the rise of the board's depth per mm right and down, p the view step."""
    tilt_sigma_mm: tuple[float, float]
    term: FieldTerm | None
    """None where a board of constant tilt explains the planes as well."""
    left_out: tuple[float, float]
    """Mean squared miss of a distance left out, in sigmas, without a term and with one."""


def fit_field(tilts: Sequence[BoardTilt], at_px: tuple[float, float]) -> FieldFit | None:
    """Tell the tilt of the board from a field of the cameras.

    1 / Z of a plane is linear in the pixel and its change per px is its tilt over its distance. A
    board that keeps its tilt therefore changes the slope by A / Z per px; what does not fall with
    the distance, B, comes from the cameras. Distances left out choose between A / Z and A / Z + B,
    for both directions together, by the one-standard-error rule (Hastie, Tibshirani and Friedman,
    The Elements of Statistical Learning, 2nd ed., section 7.10).

    Args:
        tilts: one per stop of the fit.
        at_px: pixel where the term is to be 0: the optical axis of the reference camera.

    Returns:
        None for fewer than five distances.
    """
    ordered = sorted(tilts, key=lambda t: t.distance_mm)
    distance_mm = np.array([t.distance_mm for t in ordered])
    if not ordered:
        return None
    group = same_distance(distance_mm)
    if group[-1] + 1 < FEWEST_DISTANCES:
        return None
    per_px = np.array([t.per_px for t in ordered])
    sigma = np.array([t.sigma for t in ordered])
    plain, full = (
        (1.0 / distance_mm)[:, None],
        np.stack([1.0 / distance_mm, np.ones_like(distance_mm)], 1),
    )
    misses = [_left_out(design, per_px, sigma, group) for design in (plain, full)]
    worse = misses[0] - misses[1]
    needed = worse.mean() > worse.std(ddof=1) / np.sqrt(worse.size)
    fits = [_fit(full if needed else plain, per_px[:, axis], sigma[:, axis]) for axis in (0, 1)]
    (x, x_covariance), (y, y_covariance) = fits
    term = None
    if needed:
        covariance = ((float(x_covariance[1, 1]), 0.0), (0.0, float(y_covariance[1, 1])))
        term = FieldTerm(at_px, (float(x[1]), float(y[1])), covariance)
    return FieldFit(
        tilt_mm=(float(x[0]), float(y[0])),
        tilt_sigma_mm=(float(x_covariance[0, 0]) ** 0.5, float(y_covariance[0, 0]) ** 0.5),
        term=term,
        left_out=(float(misses[0].mean()), float(misses[1].mean())),
    )


def _left_out(design: Float, per_px: Float, sigma: Float, group: NDArray[np.intp]) -> Float:
    """Squared miss of every distance left out, in sigmas, mean over its stops and directions."""
    misses: list[float] = []
    for out in range(int(group[-1]) + 1):
        kept, gone = group != out, group == out
        squares: list[float] = []
        for axis in (0, 1):
            found, _ = _fit(design[kept], per_px[kept, axis], sigma[kept, axis])
            miss = (per_px[gone, axis] - design[gone] @ found) / sigma[gone, axis]
            squares.append(float(np.mean(miss**2)))
        misses.append(float(np.mean(squares)))
    return np.array(misses)


def _fit(design: Float, value: Float, sigma: Float) -> tuple[Float, Float]:
    """Weighted least squares; the covariance is widened to the scatter where that is larger."""
    weighted = design / sigma[:, None]
    normal = weighted.T @ weighted
    found = np.linalg.solve(normal, weighted.T @ (value / sigma))
    freedom = max(len(value) - design.shape[1], 1)
    scatter = float((((value - design @ found) / sigma) ** 2).sum()) / freedom
    return np.asarray(found, np.float64), np.linalg.inv(normal) * max(scatter, 1.0)
