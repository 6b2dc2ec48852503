"""How far stops lie from a curve."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.curve.law import Law
from rig.curve.points import CurvePoint


@dataclass(frozen=True, slots=True)
class Residual:
    """One stop against one curve."""

    point: CurvePoint
    error_px: float
    """Measured slope less the curve's."""
    error_mm: float
    """Depth that the curve gives to the measured slope, less the stop's distance.

    To first order, at the stop's distance: so it is also defined for the end stops, whose noise may
    put the slope a hair outside the curve's domain.
    """

    @property
    def error_pct(self) -> float:
        """Depth error in per cent of the distance."""
        return 100 * self.error_mm / self.point.distance_mm


def residuals_of(points: Sequence[CurvePoint], law: Law) -> tuple[Residual, ...]:
    """Compare stops, inside the distances that the law was fitted to, with a law."""
    if not points:
        return ()
    curve_px = law.slope_px(np.array([p.distance_mm for p in points]))
    error_px = np.array([p.slope_px for p in points]) - curve_px
    error_mm = error_px * law.depth_per_slope(curve_px)
    return tuple(
        Residual(point, px, mm)
        for point, px, mm in zip(points, error_px.tolist(), error_mm.tolist(), strict=True)
    )
