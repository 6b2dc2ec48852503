"""The depth error of one pixel of a dense map, which is what a capture gives.

The error at held-out distances is that of a plane through thousands of edge pixels. A pixel of a
map rests on its own neighbourhood: its sigma is measured in every sample of a sweep.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.curve.curve import Curve
from rig.curve.depth_error import DepthError


@dataclass(frozen=True, slots=True)
class PixelSigma:
    """How well one pixel of the board is known at one stop."""

    distance_mm: float
    sigma_px: float
    """Median 1 sigma of the slopes of the board's pixels."""


def pixel_errors(
    curve: Curve, pixels: Sequence[PixelSigma], at_mm: Sequence[float]
) -> tuple[DepthError, ...]:
    """Expanded uncertainty (k = 2) of the depth of a median pixel; empty where none is known.

    Between two stops sigma is a straight line over distance, before the first and behind the last
    as there; that of the curve is added, as in a depth map.

    Args:
        curve: Of the rig.
        pixels: Of its sweep; several of one distance are averaged.
        at_mm: Distances inside the curve's range.
    """
    if not pixels:
        return ()
    by_distance: dict[float, list[float]] = {}
    for pixel in pixels:
        by_distance.setdefault(pixel.distance_mm, []).append(pixel.sigma_px)
    known_mm = sorted(by_distance)
    sigmas_px = [float(np.mean(by_distance[distance])) for distance in known_mm]
    distance_mm = np.asarray(at_mm, np.float64)
    sigma_px = np.interp(distance_mm, known_mm, sigmas_px)
    sigma_mm = curve.depth_sigma_mm(curve.slope_px(distance_mm), sigma_px)
    return tuple(map(DepthError, distance_mm.tolist(), (2.0 * sigma_mm).tolist()))
