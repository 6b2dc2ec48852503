"""From the measurements of a sweep to one point per stop."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.curve import CurvePoint
from rig.database import Measurement, Sample, SampleKey
from rig.plan import Stop
from rig.sweep.measure import CORNERS, TRACK_RESIDUAL


@dataclass(frozen=True, slots=True)
class StopResult:
    """What the samples of one stop say together."""

    stop: Stop
    point: CurvePoint | None
    """None where the stop gives no slope that can be trusted."""
    corner_slope_px: float | None
    """Mean over the samples, from the tracks of the corners alone."""
    dense_slope_px: float | None
    """Mean over the samples, from the estimator that captures use."""
    track_residual_px: float | None
    """Mean over the samples of the rms distance of the corners from their epipolar lines."""
    motion_px: float | None
    """Corner motion between the first and the last sample, rms."""
    problem: str | None
    """Why there is no point, in words."""


def stop_results(
    samples: Sequence[Sample],
    measurements: Mapping[SampleKey, Measurement],
    *,
    max_motion_px: float,
) -> tuple[StopResult, ...]:
    """Average the samples of every stop that has any, in the order of the plan.

    A stop gives a point only if all of its samples have a slope and the board stood still between
    the first and the last of them.

    Args:
        samples: all samples of the sweep.
        measurements: by stop and sample number.
        max_motion_px: largest corner motion of a board at rest.
    """
    stops: dict[int, list[Sample]] = {}
    for sample in samples:
        stops.setdefault(sample.stop.index, []).append(sample)
    return tuple(
        _stop_result(group, [measurements.get(s.key) for s in group], max_motion_px)
        for _, group in sorted(stops.items())
    )


def _stop_result(
    samples: Sequence[Sample], measured: Sequence[Measurement | None], max_motion_px: float
) -> StopResult:
    stop = samples[0].stop
    good = [m for m in measured if m is not None and m.slope_px is not None]
    motion_px = _motion_px(good[0], good[-1]) if len(good) > 1 else None
    problem = _problem(stop, measured, motion_px, max_motion_px)
    return StopResult(
        stop=stop,
        point=None if problem else _point(samples, good),
        corner_slope_px=_mean([m.corner_slope_px for m in good]),
        dense_slope_px=_mean([m.dense_slope_px for m in good]),
        track_residual_px=_mean([_number(m.details.get(TRACK_RESIDUAL)) for m in good]),
        motion_px=motion_px,
        problem=problem,
    )


def _point(samples: Sequence[Sample], measured: Sequence[Measurement]) -> CurvePoint:
    slopes_px = [m.slope_px for m in measured if m.slope_px is not None]
    count = len(slopes_px)
    # One sample shows no scatter: its own sigma stands in.
    std_px = statistics.stdev(slopes_px) if count > 1 else measured[0].sigma_px or 0.0
    stop = samples[0].stop
    return CurvePoint(
        distance_mm=statistics.fmean(sample.reached_mm for sample in samples),
        slope_px=statistics.fmean(slopes_px),
        std_px=std_px,
        sem_px=std_px / count**0.5,
        samples=count,
        role=stop.role,
        direction=stop.direction,
    )


def _problem(
    stop: Stop,
    measured: Sequence[Measurement | None],
    motion_px: float | None,
    max_motion_px: float,
) -> str | None:
    place = f"stop {stop.index} at {stop.distance_mm:.1f} mm ({stop.direction})"
    for measurement in measured:
        if measurement is None:
            return f"{place}: not measured yet; run `rig fit` on this sweep"
        if measurement.failure is not None:
            return f"{place}: {measurement.failure.message}"
    if motion_px is not None and motion_px > max_motion_px:
        return (
            f"{place}: the board moved {motion_px:.3f} px between first and last sample, allowed "
            f"{max_motion_px:.3f} px; raise sweep.settle_s or look for vibration"
        )
    return None


def _motion_px(first: Measurement, last: Measurement) -> float:
    places_px = [np.asarray(m.details[CORNERS], np.float64) for m in (first, last)]
    difference_px = places_px[0] - places_px[1]
    return float(np.sqrt(np.mean(np.sum(difference_px**2, axis=-1))))


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return statistics.fmean(known) if known else None
