"""How far points scatter, per view and per sighting, and what each point weighs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.geometry.calibration.observations import Observations

Float = NDArray[np.float64]

FREEDOM = 8.0
"""Student's t for the single point: weighs 3 % less well than squares if errors are normal."""
SIGHTING_FREEDOM = 40.0
"""How many residuals the belief is worth that a sighting scatters like the others of its view."""
OUTLIER_SIGMAS = 5.0
"""Points farther from where they should be, in units of their sigma, take no part."""
_LEAST_SCALE = 1e-9
_MEDIAN_SQUARE = 2.0 * np.log(2.0)
"""Median of the squared length of a normal error in two dimensions."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Scales of the residuals."""

    view_scale: Float
    """(V,) true sigma over the detector's, of each view."""
    sighting_scale: Float
    """(S,) a sighting's own factor on top of its view's: 1 is like the others."""
    sigma_px: Float
    """(M,) sigma per coordinate of every point."""
    distance: Float
    """(M,) residual length over sigma."""


def measure_scatter(observed: Observations, residual_px: Float, view_count: int) -> Scatter:
    """Estimate scales from medians, so that a share of bad points and sightings does not matter.

    A sighting's own scale is shrunk towards that of its view as an inverse-gamma prior would.
    """
    square = np.sum(residual_px**2, axis=1) / observed.sigma_px**2
    sighting = observed.sighting_of_point
    view_scale = np.ones(view_count)
    for view in range(view_count):
        own = square[observed.view[sighting] == view]
        if own.size:
            view_scale[view] = _scale(own)
    sighting_scale = np.ones(len(observed.view))
    for index, view in enumerate(observed.view):
        own = square[observed.points(index)]
        ratio = (_scale(own) / view_scale[view]) ** 2
        count = 2.0 * own.size
        sighting_scale[index] = np.sqrt(
            (SIGHTING_FREEDOM + count * ratio) / (SIGHTING_FREEDOM + count)
        )
    scale = view_scale[observed.view] * sighting_scale
    sigma_px = observed.sigma_px * scale[sighting]
    return Scatter(view_scale, sighting_scale, sigma_px, np.sqrt(square) / scale[sighting])


def _scale(square: Float) -> float:
    """Scale of (N,) squared lengths from their median; the least one where they vanish."""
    ordered = np.sort(square)  # inf stays last; np.median takes ten times as long on few numbers
    middle = (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) / 2
    return float(np.clip(np.sqrt(middle / _MEDIAN_SQUARE), _LEAST_SCALE, 1 / _LEAST_SCALE))


def point_weights(scatter: Scatter, *, reject: bool) -> Float:
    """(M,) inverse variances times Student's weight; 0 for outliers once they are rejected.

    K. Lange, R. Little, J. Taylor, "Robust statistical modeling using the t distribution", JASA
    84, 1989.
    """
    square = scatter.distance**2
    weight = (FREEDOM + 2.0) / (FREEDOM + square) / scatter.sigma_px**2
    if reject:
        weight[scatter.distance > OUTLIER_SIGMAS] = 0.0
    weight[~np.isfinite(square)] = 0.0
    return weight
