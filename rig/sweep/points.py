"""From the measurements of a sweep to one point per stop."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.curve import CurvePoint, FieldTerm
from rig.curve.reading import with_distance_sigma
from rig.geometry.epipolar_error import EpipolarError
from rig.measurement import Measurement
from rig.optics.optics import Optics
from rig.plan import Stop
from rig.records import Sample, SampleKey


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
    epipolar: EpipolarError | None
    """Of the corners; means over the samples, and the largest of them all."""
    centre_px: tuple[float, float] | None
    """Mean place of the board's centre in the rectified reference view."""
    tilt: tuple[float, float] | None
    """Mean change of the slope over the board, per px right and down."""
    tilt_sigma: tuple[float, float] | None
    """1 sigma of `tilt` from the images' noise."""
    problem: str | None
    """Why there is no point, in words."""
    pixel_sigma_px: float | None = None
    """Mean over the samples of the median 1 sigma of one pixel in their dense maps."""


def stop_results(
    samples: Sequence[Sample],
    measurements: Mapping[SampleKey, Measurement],
    *,
    max_motion_px: float,
    optics: Optics,
) -> tuple[StopResult, ...]:
    """Average the samples of every stop that has any, in the order of the plan.

    A stop gives a point only if all of its samples have a slope and the board stood still between
    the first and the last of them.

    Args:
        samples: all samples of the sweep.
        measurements: by stop and sample number.
        max_motion_px: largest corner motion of a board at rest.
        optics: what the samples were measured with. All slopes are told as on the reference
            camera's optical axis, and distances by the calibrated stage where there is one.
    """
    stops: dict[int, list[Sample]] = {}
    for sample in samples:
        stops.setdefault(sample.stop.index, []).append(sample)
    return tuple(
        _stop_result(group, [measurements.get(s.key) for s in group], max_motion_px, optics)
        for _, group in sorted(stops.items())
    )


def _stop_result(
    samples: Sequence[Sample],
    measured: Sequence[Measurement | None],
    max_motion_px: float,
    optics: Optics,
) -> StopResult:
    stop = samples[0].stop
    good = [m for m in measured if m is not None and m.slope_px is not None]
    motion_px = _motion_px(good[0], good[-1]) if len(good) > 1 else None
    problem = _problem(stop, measured, motion_px, max_motion_px)
    return StopResult(
        stop=stop,
        point=None if problem else _point(samples, good, optics),
        corner_slope_px=_mean([_on_axis(m, m.corner_slope_px, optics) for m in good]),
        dense_slope_px=_mean([_on_axis(m, m.dense_slope_px, optics) for m in good]),
        track_residual_px=_mean([m.track_residual_px for m in good]),
        motion_px=motion_px,
        epipolar=_epipolar(good),
        centre_px=_mean_pair([m.centre_px for m in good]),
        tilt=_mean_pair([_tilt(m, optics) for m in good]),
        tilt_sigma=_tilt_sigma(good),
        problem=problem,
        pixel_sigma_px=_mean([m.dense_pixel_sigma_px for m in good]),
    )


def place_of(stop: Stop) -> str:
    """Return how a stop is called in messages; what is wrong with it follows behind a colon."""
    return f"stop {stop.index} at {stop.distance_mm:.1f} mm ({stop.direction})"


def with_reading(stops: tuple[StopResult, ...], distance_sigma_mm: float) -> tuple[StopResult, ...]:
    """Have the slopes bear what distances are uncertain by (1 sigma); 0 changes nothing."""
    if not distance_sigma_mm:
        return stops
    known = [stop.point for stop in stops if stop.point is not None]
    points = iter(with_distance_sigma(known, distance_sigma_mm))
    return tuple(s if s.point is None else replace(s, point=next(points)) for s in stops)


def without_field(stops: Sequence[StopResult], term: FieldTerm) -> tuple[StopResult, ...]:
    """Take the field term of a curve out of the slopes of all stops."""
    return tuple(_without_field(stop, term) for stop in stops)


def _without_field(stop: StopResult, term: FieldTerm) -> StopResult:
    if stop.point is None or stop.centre_px is None:
        return stop
    added_px = term.slope_px(*stop.centre_px)

    def less(slope_px: float | None) -> float | None:
        return None if slope_px is None else slope_px - added_px

    return replace(
        stop,
        point=replace(stop.point, slope_px=stop.point.slope_px - added_px),
        corner_slope_px=less(stop.corner_slope_px),
        dense_slope_px=less(stop.dense_slope_px),
    )


def axis_slopes_px(measured: Sequence[Measurement], optics: Optics) -> list[float]:
    """Slopes of those measurements that have one, as on the reference camera's optical axis."""
    slopes_px = [_on_axis(m, m.slope_px, optics) for m in measured]
    return [slope_px for slope_px in slopes_px if slope_px is not None]


def _on_axis(measurement: Measurement, slope_px: float | None, optics: Optics) -> float | None:
    if slope_px is None or measurement.plane is None or measurement.centre_px is None:
        return slope_px
    _, b, c = measurement.plane
    return optics.axis_plane((slope_px, b, c), measurement.centre_px)[0]


def _tilt(measurement: Measurement, optics: Optics) -> tuple[float, float] | None:
    if measurement.plane is None or measurement.centre_px is None:
        return None
    _, b, c = optics.axis_plane(measurement.plane, measurement.centre_px)
    return b, c


def _tilt_sigma(measured: Sequence[Measurement]) -> tuple[float, float] | None:
    """Of the mean over the samples."""
    known = np.array([m.plane_sigma for m in measured if m.plane_sigma is not None])
    if not known.size:
        return None
    _, b, c = (np.sqrt((known**2).sum(axis=0)) / len(known)).tolist()
    return b, c


def _epipolar(measured: Sequence[Measurement]) -> EpipolarError | None:
    known = [m.epipolar for m in measured if m.epipolar is not None]
    if not known:
        return None
    return EpipolarError(
        mean_px=statistics.fmean(error.mean_px for error in known),
        p95_px=statistics.fmean(error.p95_px for error in known),
        max_px=max(error.max_px for error in known),
    )


def _mean_pair(pairs: Sequence[tuple[float, float] | None]) -> tuple[float, float] | None:
    known = [pair for pair in pairs if pair is not None]
    if not known:
        return None
    return statistics.fmean(x for x, _ in known), statistics.fmean(y for _, y in known)


def _point(
    samples: Sequence[Sample], measured: Sequence[Measurement], optics: Optics
) -> CurvePoint:
    slopes_px = axis_slopes_px(measured, optics)
    count = len(slopes_px)
    # One sample shows no scatter: its own sigma stands in.
    std_px = statistics.stdev(slopes_px) if count > 1 else measured[0].sigma_px or 0.0
    stop = samples[0].stop
    return CurvePoint(
        distance_mm=statistics.fmean(optics.distance_mm(s.reached_mm) for s in samples),
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
    place = place_of(stop)
    for measurement in measured:
        if measurement is None:
            return f"{place}: not measured yet; run `rig fit` on this sweep"
        if measurement.failure is not None:
            return f"{place}: {measurement.failure.message}"
    if motion_px is None and len(measured) > 1:
        return f"{place}: its corners are not stored; run `rig fit` on this sweep"
    if motion_px is not None and motion_px > max_motion_px:
        return (
            f"{place}: the board moved {motion_px:.3f} px between first and last sample, allowed "
            f"{max_motion_px:.3f} px; raise sweep.settle_s or look for vibration"
        )
    return None


def _motion_px(first: Measurement, last: Measurement) -> float | None:
    if first.corners_px is None or last.corners_px is None:
        return None
    difference_px = np.array(first.corners_px) - np.array(last.corners_px)
    return float(np.sqrt(np.mean(np.sum(difference_px**2, axis=-1))))


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return statistics.fmean(known) if known else None
