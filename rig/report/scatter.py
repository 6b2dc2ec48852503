"""How well the stops of a sweep repeat, as plain numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.curve import Curve, CurvePoint
from rig.measurement import Measurement
from rig.records import Sample, SampleKey
from rig.sweep.points import StopResult


@dataclass(frozen=True, slots=True)
class Deviation:
    """One sample against the mean of its stop."""

    point: CurvePoint
    error_px: float


@dataclass(frozen=True, slots=True)
class Repeatability:
    """Scatter of single samples, pooled over the stops that have two or more."""

    std_px: float
    """Root mean square of the stops' standard deviations."""
    freedom: int
    """Degrees of freedom behind it."""
    largest_mm: float
    """Largest standard deviation of a stop, as depth."""
    at_mm: float
    """Where that is."""


@dataclass(frozen=True, slots=True)
class DirectionPair:
    """A distance that was visited in both directions: backward less forward."""

    distance_mm: float
    difference_px: float
    """Of the residuals, so that unequal read-back positions do not count."""
    expanded_px: float
    """k = 2, from the standard errors of both means."""
    difference_mm: float
    expanded_mm: float


@dataclass(frozen=True, slots=True)
class EstimatorGap:
    """Two other estimators against the line fit, at one stop."""

    point: CurvePoint
    corner_px: float | None
    """Slope from corner tracks less that of the line fit."""
    dense_px: float | None
    """Slope of the dense estimator less that of the line fit."""
    limit_px: float
    """The difference that makes a depth error of the limit."""
    pct_per_px: float
    """Depth in per cent of distance that a slope difference makes; negative."""

    @property
    def alarms(self) -> tuple[str, ...]:
        """Which estimators are off by more than the limit."""
        gaps = {"corner": self.corner_px, "dense": self.dense_px}
        return tuple(
            name for name, gap in gaps.items() if gap is not None and abs(gap) > self.limit_px
        )


def mm_per_px(curve: Curve, distance_mm: float) -> float:
    """Change of depth with slope at a distance; negative."""
    slope_px = curve.law.slope_px(np.array([distance_mm]))
    return float(curve.law.depth_per_slope(slope_px)[0])


def deviations(
    stops: Sequence[StopResult],
    samples: Sequence[Sample],
    measurements: Mapping[SampleKey, Measurement],
) -> list[Deviation]:
    """Compare every sample with the mean of its stop, where the stop has two or more."""
    points = {s.stop.index: s.point for s in stops if s.point is not None}
    found: list[Deviation] = []
    for sample in samples:
        point = points.get(sample.stop.index)
        slope_px = measurements[sample.key].slope_px if point is not None else None
        if point is not None and slope_px is not None and point.samples > 1:
            found.append(Deviation(point, slope_px - point.slope_px))
    return found


def repeatability(stops: Sequence[StopResult], curve: Curve) -> Repeatability | None:
    """Pool the scatter of all stops; None where no stop has two samples."""
    points = [s.point for s in stops if s.point is not None and s.point.samples > 1]
    if not points:
        return None
    freedom = np.array([p.samples - 1 for p in points])
    variance_px2 = np.array([p.std_px for p in points]) ** 2
    stds_mm = [p.std_px * abs(mm_per_px(curve, p.distance_mm)) for p in points]
    worst = int(np.argmax(stds_mm))
    return Repeatability(
        std_px=float(np.sqrt(freedom @ variance_px2 / freedom.sum())),
        freedom=int(freedom.sum()),
        largest_mm=stds_mm[worst],
        at_mm=points[worst].distance_mm,
    )


def direction_pairs(stops: Sequence[StopResult], curve: Curve) -> list[DirectionPair]:
    """Pair the visits of each distance that both directions have, from near to far."""
    visits: dict[float, dict[str, CurvePoint]] = {}
    for stop in stops:
        if stop.point is not None:
            visits.setdefault(stop.stop.distance_mm, {})[stop.stop.direction] = stop.point
    pairs: list[DirectionPair] = []
    for distance_mm, visit in sorted(visits.items()):
        if len(visit) == 2:
            forward, backward = visit["forward"], visit["backward"]
            reached_mm = np.array([forward.distance_mm, backward.distance_mm])
            expected_px = curve.law.slope_px(reached_mm)
            gap_px = (backward.slope_px - forward.slope_px) - float(expected_px @ [-1.0, 1.0])
            expanded_px = 2.0 * float(np.hypot(forward.sem_px, backward.sem_px))
            rate = mm_per_px(curve, distance_mm)
            pairs.append(
                DirectionPair(
                    distance_mm, gap_px, expanded_px, rate * gap_px, abs(rate) * expanded_px
                )
            )
    return pairs


def estimator_gaps(
    stops: Sequence[StopResult], curve: Curve, limit_pct: float
) -> list[EstimatorGap]:
    """Compare the estimators at every stop that has a slope.

    Args:
        stops: of the sweep.
        curve: what turns slopes into depth.
        limit_pct: depth error, per cent of distance, that a difference may make.
    """
    gaps: list[EstimatorGap] = []
    for stop in stops:
        point = stop.point
        if point is not None:
            rate = 100.0 * mm_per_px(curve, point.distance_mm) / point.distance_mm
            gaps.append(
                EstimatorGap(
                    point,
                    _less(stop.corner_slope_px, point.slope_px),
                    _less(stop.dense_slope_px, point.slope_px),
                    limit_px=abs(limit_pct / rate),
                    pct_per_px=rate,
                )
            )
    return sorted(gaps, key=lambda gap: gap.point.distance_mm)


def _less(value: float | None, other: float) -> float | None:
    return None if value is None else value - other
