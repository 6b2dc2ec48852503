"""The end of a sweep: curve, held-out error and gates, from what is stored and nothing else."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

from rig.calibrations import calibration_of
from rig.curve import CurveFit, Headline, fit_curve, headline
from rig.database import Store, Sweep, software_versions
from rig.errors import CurveError
from rig.optics.rectifier import Rectifier, rectifier_of
from rig.profile import Profile
from rig.profile.load import parse_profile
from rig.sweep.alignment import Alignment, board_field, measure_alignment
from rig.sweep.calibration_use import CalibrationUse, calibration_use
from rig.sweep.gates import Gate, quality_gates
from rig.sweep.points import StopResult, stop_results, without_field
from rig.sweep.request import sweep_setup
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
    times: SweepTimes | None
    """None where the slopes were computed again from stored frames."""

    @property
    def failed_gates(self) -> tuple[str, ...]:
        """What keeps this curve from being used without asking, one line each."""
        return _failures(self.gates, self.stops)

    def as_dict(self) -> dict[str, object]:
        """Return the result as the command line's JSON contract."""
        curve = self.fit.best
        return {
            "sweep": self.sweep_id,
            "database": self.database,
            "report": str(self.report),
            "points": [asdict(stop.point) for stop in self.stops if stop.point is not None],
            "curve": {
                "id": self.curve_id,
                "model": curve.model,
                "params": curve.params,
                "focus_mm": curve.focus_mm,
                "valid_mm": list(curve.valid_mm),
            },
            "holdout": _holdout(self.fit) or None,
            "failed_gates": list(self.failed_gates),
            "alignment": self.alignment.as_dict(),
            "epipolar_px": _epipolar(self.stops),
            "calibration": None if self.calibration is None else self.calibration.as_dict(),
            "times": None if self.times is None else asdict(self.times),
        }

    def lines(self) -> list[str]:
        """Return the result for a person, the most important first."""
        curve, holdout = self.fit.best, self.fit.holdout
        lines = [f"{self.rig}: {self.headline}"]
        if holdout is not None:
            lines.append(
                f"held-out distances: rms {holdout.rms_pct:.4f} % ({holdout.rms_mm:.3f} mm), "
                f"largest {holdout.max_pct:.4f} %, bias {holdout.bias_pct:+.4f} %"
            )
        focus = "outside the sweep"
        if curve.focus_mm is not None and curve.focus_sigma_mm is not None:
            focus = f"{curve.focus_mm:.2f} +- {2.0 * curve.focus_sigma_mm:.2f} mm (k=2)"
        lines.append(f"curve {self.curve_id}: {curve.model}, focus distance {focus}")
        if self.calibration is not None:
            lines += self.calibration.lines()
        if (errors := _epipolar(self.stops)) is not None:
            lines.append(
                f"epipolar error: mean {errors['mean']:.3f} px, 95th percentile "
                f"{errors['p95']:.3f} px, largest {errors['max']:.3f} px"
            )
        lines += self.alignment.lines()
        lines += [f"note: {warning}" for warning in self.fit.warnings]
        if self.times is not None:
            lines.append(self.times.line())
        lines.append(f"sweep {self.sweep_id} in {self.database}")
        lines.append(f"report: {self.report}")
        return lines


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
    )
    return _result(store, sweep_id, evidence, curve_id, times)


def stored_conclusion(store: Store, sweep_id: int) -> SweepResult:
    """Return what `conclude_sweep` found, without storing another curve.

    Raises:
        CurveError: the sweep has no curve.
        StoreError: no such sweep.
    """
    evidence = _fit(store, sweep_id)
    curve_ids = [row.curve_id for row in store.sweeps() if row.id == sweep_id]
    if not curve_ids or curve_ids[0] is None:
        raise CurveError(f"sweep {sweep_id} has no curve yet", advice=f"run `rig fit {sweep_id}`")
    return _result(store, sweep_id, evidence, curve_ids[0], None)


@dataclass(frozen=True, slots=True)
class _Evidence:
    stops: tuple[StopResult, ...]
    fit: CurveFit
    alignment: Alignment
    calibration: CalibrationUse | None


def _fit(store: Store, sweep_id: int) -> _Evidence:
    sweep = store.sweep(sweep_id)
    profile = stored_profile(sweep)
    rectifier = stored_rectifier(store, sweep)
    stops = stop_results(
        store.samples(sweep_id),
        store.measurements(sweep_id),
        max_motion_px=sweep_setup(profile).config.max_motion_px,
        rectifier=rectifier,
    )
    field = board_field(stops, rectifier)
    term = None if field is None else field.term
    if term is not None:
        stops = without_field(stops, term)
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
    alignment = measure_alignment(stops, rectifier, field, focal_px)
    fit = replace(fit, best=replace(fit.best, field=term))
    return _Evidence(stops, fit, alignment, calibration_use(stops, rectifier))


def _result(
    store: Store,
    sweep_id: int,
    evidence: _Evidence,
    curve_id: int,
    times: SweepTimes | None,
) -> SweepResult:
    sweep = store.sweep(sweep_id)
    stops, fit = evidence.stops, evidence.fit
    return SweepResult(
        sweep_id=sweep_id,
        rig=sweep.rig,
        database=store.database,
        report=sweep.folder / REPORT_FILE,
        stops=stops,
        fit=fit,
        curve_id=curve_id,
        headline=headline(fit.best, fit.holdout),
        gates=quality_gates(stored_profile(sweep), fit.holdout, stops),
        alignment=evidence.alignment,
        calibration=evidence.calibration,
        times=times,
    )


def stored_profile(sweep: Sweep) -> Profile:
    """Return the profile that a sweep was taken with.

    Raises:
        ConfigError: it was written by a version with other keys.
    """
    return parse_profile(dict(sweep.profile), source=f"profile stored with sweep {sweep.id}")


def stored_rectifier(store: Store, sweep: Sweep) -> Rectifier:
    """Return what the samples of a sweep are measured with.

    Raises:
        ConfigError: profile or calibration were written by another version.
        StoreError: the calibration cannot be read.
    """
    return rectifier_of(stored_profile(sweep), calibration_of(store, sweep.calibration_id))


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
    return (*missed, *(stop.problem for stop in stops if stop.problem is not None))


def _epipolar(stops: tuple[StopResult, ...]) -> dict[str, float] | None:
    """Mean of all stops, their largest 95th percentile, and the largest of all."""
    found = [stop.epipolar for stop in stops if stop.epipolar is not None]
    if not found:
        return None
    return {
        "mean": sum(error.mean_px for error in found) / len(found),
        "p95": max(error.p95_px for error in found),
        "max": max(error.max_px for error in found),
    }
