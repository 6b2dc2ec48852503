"""How far points scatter, per view and per sighting, and what each point weighs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.geometry.bundle.observations import Observations

FREEDOM = 8.0
"""Student's t for the single point, while the answer is far and nothing is rejected."""
SIGHTING_FREEDOM = 40.0
"""How many residuals the belief is worth that a sighting scatters like the others of its view."""
OUTLIER_SIGMAS = 5.0
"""Points farther from where they should be, in units of their sigma, take no part."""
_FLOORS = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
"""Tried for a view, in typical sigmas of the detector; with 8 all points weigh alike."""
_LEAST_SCALE = 1e-9
_MEDIAN_SQUARE = 2.0 * np.log(2.0)
"""Median of the squared length of a normal error in two dimensions."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Scales of the residuals."""

    floor_px: Float
    """(V,) added in squares to what the detector says before it is scaled: lenses, boards and
    prints are not quite as modelled, however sharp a corner is."""
    view_scale: Float
    """(V,) true sigma over the detector's with its floor, of each view."""
    sighting_scale: Float
    """(S,) a sighting's own factor on top of its view's: 1 is like the others."""
    sigma_px: Float
    """(M,) sigma per coordinate of every point."""
    distance: Float
    """(M,) residual length over sigma."""


def measure_scatter(
    observed: Observations, residual_px: Float, view_count: int, floor_px: Float | None = None
) -> Scatter:
    """Estimate scales from medians, so that a share of bad points and sightings does not matter.

    A sighting's own scale is shrunk towards that of its view as an inverse-gamma prior would.

    Args:
        observed: M points in S sightings.
        residual_px: (M, 2).
        view_count: V.
        floor_px: (V,) to keep; measured if it is not given.
    """
    length_px2 = np.sum(residual_px**2, axis=1)
    sighting = observed.sighting_of_point
    of_view = [observed.view[sighting] == view for view in range(view_count)]
    if floor_px is None:
        floor_px = np.array([_floor_px(length_px2[own], observed.sigma_px[own]) for own in of_view])
    told_px = np.hypot(observed.sigma_px, floor_px[observed.view[sighting]])
    square = length_px2 / told_px**2
    view_scale = np.ones(view_count)
    for view, own in enumerate(of_view):
        if own.any():
            view_scale[view] = _scale(square[own])
    ratio = (_scales(square, observed.start) / view_scale[observed.view]) ** 2
    count = 2.0 * np.diff(observed.start)
    sighting_scale = np.sqrt((SIGHTING_FREEDOM + count * ratio) / (SIGHTING_FREEDOM + count))
    scale = view_scale[observed.view] * sighting_scale
    sigma_px = told_px * scale[sighting]
    return Scatter(
        floor_px, view_scale, sighting_scale, sigma_px, np.sqrt(square) / scale[sighting]
    )


def _floor_px(length_px2: Float, sigma_px: Float) -> float:
    """Likeliest floor under the detector's sigmas (M,), for residuals of squared lengths (M,).

    Under Student's t in two dimensions, with a common scale that the median tells.
    """
    finite = np.isfinite(length_px2)
    if not finite.any():
        return 0.0
    typical = float(np.median(sigma_px[finite]))
    floors = typical * _FLOORS
    misfits: list[float] = []
    for floor in floors:
        variance = sigma_px[finite] ** 2 + floor**2
        square = length_px2[finite] / variance
        scale = _scale(square)
        tail = float(np.mean(np.log1p(square / (FREEDOM * scale**2))))
        spread = 2.0 * np.log(scale) + float(np.mean(np.log(variance)))
        misfits.append(spread + (FREEDOM + 2.0) / 2.0 * tail)
    return float(floors[int(np.argmin(misfits))])


def _scale(square: Float) -> float:
    """Scale of (N,) squared lengths from their median; the least one where they vanish."""
    places = [(len(square) - 1) // 2, len(square) // 2]
    middle = np.partition(square, places)[places].mean()  # inf stays last
    return float(np.clip(np.sqrt(middle / _MEDIAN_SQUARE), _LEAST_SCALE, 1 / _LEAST_SCALE))


@kernel()
def _scales(square: Float, start: NDArray[np.int64]) -> Float:
    """(S,) the same of S short parts, from `start` (S + 1,)."""
    scales = np.empty(start.size - 1)
    for s in range(start.size - 1):
        ordered = np.sort(square[start[s] : start[s + 1]])
        middle = (ordered[(ordered.size - 1) // 2] + ordered[ordered.size // 2]) / 2
        scales[s] = min(max(np.sqrt(middle / _MEDIAN_SQUARE), _LEAST_SCALE), 1 / _LEAST_SCALE)
    return scales


def point_weights(scatter: Scatter, *, reject: bool) -> Float:
    """(M,) inverse variances; 0 for outliers once they are rejected.

    Before that far points weigh less, as under Student's t (K. Lange, R. Little, J. Taylor, "Robust
    statistical modeling using the t distribution", JASA 84, 1989). In the end squares count alone:
    where a lens or a board is not quite as modelled, Student's weights would fit the middle of the
    picture and give its rim up.
    """
    square = scatter.distance**2
    if reject:
        weight = np.where(scatter.distance > OUTLIER_SIGMAS, 0.0, scatter.sigma_px**-2.0)
    else:
        weight = (FREEDOM + 2.0) / (FREEDOM + square) / scatter.sigma_px**2
    weight[~np.isfinite(square)] = 0.0
    return weight
