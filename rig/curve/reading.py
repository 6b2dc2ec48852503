"""Distances that are read by a person: what their uncertainty means for the slopes of a curve."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.curve.points import CurvePoint


def with_distance_sigma(
    points: Sequence[CurvePoint], distance_sigma_mm: float
) -> tuple[CurvePoint, ...]:
    """Add the uncertainty of the distances to that of the slopes: sem^2 + (dm/dZ sigma)^2.

    A fit takes distances for true, so what is uncertain in them must be said of the slopes (the
    effective variance of Orear, Am. J. Phys. 50, 1982). All samples of a stop share its distance:
    their number does not help. How steep the slopes are is taken from the points themselves.

    Args:
        points: of one sweep, in any order.
        distance_sigma_mm: 1 sigma of the place of the board at every stop.
    """
    steepness = _steepness_px_mm(points)
    return tuple(
        replace(point, sem_px=float(np.hypot(point.sem_px, change * distance_sigma_mm)))
        for point, change in zip(points, steepness, strict=True)
    )


def _steepness_px_mm(points: Sequence[CurvePoint]) -> list[float]:
    """Change of the slope over the distance at each point; 0 where there is one distance only.

    1 / Z is the natural scale: on it the law of a pinhole is a straight line, so that differences
    between neighbours tell its slope without a bias.
    """
    if not points:
        return []
    distance_mm = np.array([point.distance_mm for point in points])
    slope_px = np.array([point.slope_px for point in points])
    places_mm, group = np.unique(distance_mm, return_inverse=True)
    if len(places_mm) < 2:
        return [0.0] * len(points)
    mean_px = np.bincount(group, weights=slope_px) / np.bincount(group)
    over_inverse = np.gradient(mean_px, 1.0 / places_mm)
    return (np.abs(over_inverse) / places_mm**2)[group].tolist()
