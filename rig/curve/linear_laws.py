"""The straight lines of slope against distance, before and after the focus distance."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.curve.points import CurvePoint, same_distance

HOLDS_PCT = 1.0
"""A straight line holds where it misses no distance by more than this."""


@dataclass(frozen=True, slots=True)
class LinearLaw:
    """One straight line through the stops of one side of the focus distance."""

    side: Literal["before", "after"]
    """Before: nearer than the focus distance, slope above 0."""
    scope: Literal["side", "holds"]
    """All stops of the side, or as many, counted from the focus, as the line holds for."""
    distances_mm: tuple[float, float]
    """Nearest and farthest stop that the line was fitted to."""
    stops: int
    px_per_mm: float
    """Slope of the line."""
    zero_mm: float
    """Distance where the line crosses slope 0; the focus distance if the law were exact."""
    r2: float
    """Coefficient of determination."""
    max_px: float
    """Largest deviation of a stop from the line."""
    max_pct: float
    """Largest deviation in distance, per cent of distance."""


def linear_laws(points: Sequence[CurvePoint]) -> tuple[LinearLaw, ...]:
    """Fit the straight laws of each side that has three distances or more.

    Each side gives the line through all its stops and, where one exists, the line through the
    longest run of three distances or more, counted from the focus, that no stop misses by more
    than `HOLDS_PCT` of its distance. Lines are unweighted and free, as such laws are quoted.
    """
    before = [p for p in points if p.slope_px > 0]
    after = [p for p in points if p.slope_px <= 0]
    before.sort(key=lambda p: -p.distance_mm)
    after.sort(key=lambda p: p.distance_mm)
    return (*_side_laws("before", before), *_side_laws("after", after))


def _side_laws(side: Literal["before", "after"], outward: list[CurvePoint]) -> list[LinearLaw]:
    """Laws of one side; `outward` are its stops, the one next to the focus first."""
    if not outward:
        return []
    away_mm = np.abs([p.distance_mm - outward[0].distance_mm for p in outward])
    group = same_distance(away_mm)
    runs = [outward[: np.count_nonzero(group <= last)] for last in range(2, int(group[-1]) + 1)]
    if not runs:
        return []
    holding = [
        law for law in (_line(side, "holds", run) for run in runs) if law.max_pct <= HOLDS_PCT
    ]
    return [_line(side, "side", outward), *holding[-1:]]


def _line(
    side: Literal["before", "after"], scope: Literal["side", "holds"], points: list[CurvePoint]
) -> LinearLaw:
    distance_mm = np.array([p.distance_mm for p in points])
    slope_px = np.array([p.slope_px for p in points])
    away_mm = distance_mm - distance_mm.mean()
    away_px = slope_px - slope_px.mean()
    px_per_mm = float(away_mm @ away_px / (away_mm @ away_mm))
    miss_px = np.abs(away_px - px_per_mm * away_mm)
    return LinearLaw(
        side,
        scope,
        distances_mm=(float(distance_mm.min()), float(distance_mm.max())),
        stops=len(points),
        px_per_mm=px_per_mm,
        zero_mm=float(distance_mm.mean() - slope_px.mean() / px_per_mm),
        r2=float(1 - miss_px @ miss_px / (away_px @ away_px)),
        max_px=float(miss_px.max()),
        max_pct=float(np.max(100 * miss_px / abs(px_per_mm) / distance_mm)),
    )
