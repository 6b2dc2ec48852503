"""The end of a sweep: curve, held-out error and gates, from what is stored and nothing else."""

from dataclasses import dataclass, replace
from pathlib import Path

from rig.curve import CurveFit, Headline, PixelSigma, fit_curve, headline
from rig.database import Store, software_versions
from rig.epipolar.mending.row_errors import ROW_ERRORS_JSON, RowErrors
from rig.errors import CurveError
from rig.stored import run_of_sweep, stored_profile
from rig.sweep.alignment import Alignment, board_field, measure_alignment
from rig.sweep.calibration_use import CalibrationUse, calibration_use
from rig.sweep.gates import Gate, quality_gates
from rig.sweep.misses import misses
from rig.sweep.points import StopResult, stop_results, with_reading, without_field
from rig.sweep.request import sweep_setup
from rig.sweep.rows import rows_of_sweep
from rig.sweep.take import SweepTimes

REPORT_FILE = "report.html"


@dataclass(frozen=True, slots=True)
class SweepResult:
    """A finished sweep and what it is worth."""

    sweep_id: int
    rig: str
    database: str
    report: Path
    stops: tuple[StopResult, ...]
    fit: CurveFit
    curve_id: int
    headline: Headline
    gates: tuple[Gate, ...]
    alignment: Alignment
    calibration: CalibrationUse | None
    """None where pictures and stage positions were taken as they are."""
    row_errors: RowErrors | None
    """What the rows of the views miss by; None where the samples were measured without looking."""
    views: tuple[str, ...]
    """Their names."""
    times: SweepTimes | None
    """None where the slopes were computed again from stored frames."""

    @property
    def failed_gates(self) -> tuple[str, ...]:
        """What keeps this curve from being used without asking, one line each."""
        return _failures(self.gates, self.stops)

    @property
    def holdout(self) -> dict[str, object]:
        """Error at the held-out distances, as it is stored; empty where there were none."""
        return _holdout(self.fit)

    @property
    def row_lines(self) -> tuple[str, ...]:
        """What to say of rows that do not meet, one line for each view; nothing where all do."""
        return () if self.row_errors is None else self.row_errors.lines(self.views)

    @property
    def epipolar_px(self) -> dict[str, float] | None:
        """Distance of the corners from their epipolar lines; None where it is unknown."""
        return _epipolar(self.stops)


def conclude_sweep(store: Store, sweep_id: int, times: SweepTimes | None = None) -> SweepResult:
    """Fit the curve of a sweep from its stored slopes and judge it.

    Only a curve that passes every gate becomes the one that captures take by themselves.

    Raises:
        CurveError: too few stops gave a slope, or they contradict each other.
        StoreError: the database cannot be read or written.
    """
    evidence = _fit(store, sweep_id)
    stops, fit = evidence.stops, evidence.fit
    gates = quality_gates(stored_profile(store.sweep(sweep_id)), fit.holdout, stops)
    curve_id = store.save_curve(
        sweep_id,
        curve=fit.best.to_json(),
        holdout=_holdout(fit),
        versions=software_versions(),
        active=not _failures(gates, stops),
        row_errors=None
        if evidence.row_errors is None
        else ROW_ERRORS_JSON.to_json(evidence.row_errors),
    )
    return _result(store, sweep_id, evidence, curve_id, times)


def stored_conclusion(store: Store, sweep_id: int) -> SweepResult:
    """Return what `conclude_sweep` found, without storing another curve.

    Raises:
        CurveError: the sweep has no curve.
        StoreError: no such sweep.
    """
    evidence = _fit(store, sweep_id)
    curve_id = store.newest_curve(sweep_id)
    if curve_id is None:
        raise CurveError(f"sweep {sweep_id} has no curve yet", advice=f"run `rig fit {sweep_id}`")
    return _result(store, sweep_id, evidence, curve_id, None)


@dataclass(frozen=True, slots=True)
class _Evidence:
    stops: tuple[StopResult, ...]
    fit: CurveFit
    alignment: Alignment
    calibration: CalibrationUse | None
    row_errors: RowErrors | None


def _fit(store: Store, sweep_id: int) -> _Evidence:
    sweep = store.sweep(sweep_id)
    run = run_of_sweep(store, sweep)
    profile, optics = run.profile, run.optics
    measurements = store.measurements(sweep_id)
    stops = stop_results(
        store.samples(sweep_id),
        measurements,
        max_motion_px=sweep_setup(profile).config.max_motion_px,
        optics=optics,
    )
    field = board_field(stops, optics)
    term = None if field is None else field.term
    if term is not None:
        stops = without_field(stops, term)
    stops = with_reading(stops, 0.0 if profile.stage is None else profile.stage.distance_sigma_mm)
    try:
        fit = fit_curve([stop.point for stop in stops if stop.point is not None])
    except CurveError as error:
        problems = [stop.problem for stop in stops if stop.problem is not None]
        because = f"; {problems[0]}" if problems else ""
        raise CurveError(
            f"sweep {sweep_id} is stored, but has no curve: {error.found}{because}",
            advice=error.advice,
        ) from error
    # The slope law of a pinhole is f p / Z: its numerator tells the focal length.
    a_px_mm = fit.best.params.get("a_px_mm")
    focal_px = None if a_px_mm is None else a_px_mm / profile.pitch_mm
    alignment = measure_alignment(
        stops, optics, field, pitch_mm=profile.pitch_mm, focal_px=focal_px
    )
    fit = replace(fit, best=replace(fit.best, field=term))
    names = [view.name for view in profile.views]
    rows = rows_of_sweep(tuple(measurements.values()), names, optics)
    return _Evidence(stops, fit, alignment, calibration_use(stops, optics), rows)


def _result(
    store: Store,
    sweep_id: int,
    evidence: _Evidence,
    curve_id: int,
    times: SweepTimes | None,
) -> SweepResult:
    sweep = store.sweep(sweep_id)
    stops, fit, profile = evidence.stops, evidence.fit, stored_profile(sweep)
    return SweepResult(
        sweep_id=sweep_id,
        rig=sweep.rig,
        database=store.database,
        report=sweep.folder / REPORT_FILE,
        stops=stops,
        fit=fit,
        curve_id=curve_id,
        headline=headline(fit.best, fit.holdout, pixels=_pixel_sigmas(stops)),
        gates=quality_gates(profile, fit.holdout, stops),
        alignment=evidence.alignment,
        calibration=evidence.calibration,
        row_errors=evidence.row_errors,
        views=tuple(view.name for view in profile.views),
        times=times,
    )


def _pixel_sigmas(stops: tuple[StopResult, ...]) -> tuple[PixelSigma, ...]:
    return tuple(
        PixelSigma(stop.point.distance_mm, stop.pixel_sigma_px)
        for stop in stops
        if stop.point is not None and stop.pixel_sigma_px is not None
    )


def _holdout(fit: CurveFit) -> dict[str, object]:
    holdout = fit.holdout
    if holdout is None:
        return {}
    return {
        "bias_pct": holdout.bias_pct,
        "rms_pct": holdout.rms_pct,
        "max_pct": holdout.max_pct,
        "rms_mm": holdout.rms_mm,
    }


def _failures(gates: tuple[Gate, ...], stops: tuple[StopResult, ...]) -> tuple[str, ...]:
    missed = (str(gate) for gate in gates if not gate.passed)
    return (*missed, *misses(stops))


def _epipolar(stops: tuple[StopResult, ...]) -> dict[str, float] | None:
    """Mean of all stops, their largest 95th percentile, and the largest of all."""
    errors = [stop.epipolar for stop in stops if stop.epipolar is not None]
    if not errors:
        return None
    return {
        "mean": sum(error.mean_px for error in errors) / len(errors),
        "p95": max(error.p95_px for error in errors),
        "max": max(error.max_px for error in errors),
    }
