"""What belongs to a run, from what is stored: optics by its calibration, and its curve.

Every verb comes through here, with the one store that it has opened.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from rig.calibration_alone import curve_alone
from rig.curve import Curve
from rig.epipolar.mending.row_errors import ROW_ERRORS_JSON
from rig.errors import ConfigError, CurveError, StoreError
from rig.files import unused
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_from_json
from rig.optics.calibrated import calibrated_optics
from rig.optics.nominal import nominal_optics
from rig.optics.optics import Optics
from rig.profile import LensletCameraConfig, Profile
from rig.profile.load import parse_profile
from rig.records import Json, StoredCalibration, StoredCurve, Sweep
from rig.run import Run, RunCurve

if TYPE_CHECKING:
    from rig.database import Store

NO_CALIBRATION = "none"
LENSLETS = "lenslets"
"""Key of the geometry of a calibration that is one of lenslets, see `rig.lenslet.array`."""
CurveChoice = int | Literal["newest", "none"]
"""Number of a curve, the newest good one of the rig, or none."""


def curve_choice(number: int | None, *, slopes_only: bool) -> CurveChoice:
    """Return the choice that the options `--curve` and `--slopes-only` make."""
    if slopes_only:
        return "none"
    return "newest" if number is None else number


@dataclass(frozen=True, slots=True)
class RunChoice:
    """Which of what is stored a run is to use, as the options of a verb say it."""

    database: str | None = None
    """URL; None for the user's own."""
    calibration: str | None = None
    """Number of a calibration, `none`, or None for the newest good one of the rig, if any."""
    curve: CurveChoice = "newest"

    @property
    def absent(self) -> Literal["refused", "empty"]:
        """What a database that is not there means: without one there is no curve to choose."""
        return "empty" if self.curve == "none" else "refused"


@dataclass(frozen=True, slots=True)
class CalibratedRig:
    """A rig as a calibration found it."""

    profile: Profile
    """As it was then."""
    geometry: RigGeometry
    quality: Json
    """How good it is, as it was stored."""


def open_run(
    store: "Store",
    profile: Profile,
    calibration: str | None = None,
    curve: CurveChoice = "newest",
) -> Run:
    """Return what a run of a rig uses.

    Args:
        store: where calibrations and curves are.
        profile: the rig.
        calibration: number of a calibration, `none`, or None for the newest good one, if any.
        curve: which curve.

    Raises:
        ConfigError: the calibration is of another rig, of other views, of another stage, or of a
            version that this program does not read; or its choice is no number.
        CurveError: the curve is of another rig, of another arrangement of its cameras, or of
            another calibration.
        StoreError: there is no such calibration, or no such curve; or neither of them, and the
            profile's camera holds none of its own.
    """
    run = _run(profile, _chosen_calibration(store, profile, calibration))
    if calibration is None and run.calibration is not None:
        run = replace(run, by_itself=((f"calibration {run.calibration.id}", run.calibration.unit),))
    is_first = curve == "newest" and not store.has_curve(profile.name, profile.unit)
    if run.calibration is None and calibration is None and profile.camera.may_hold_calibration:
        if is_first:
            return replace(run, awaits="depth")
        if curve == "none" and profile.slopes.range_mm is not None:
            return replace(run, awaits="slopes")
    if curve == "none":
        return run
    if is_first and run.optics.axis_law is not None:
        found = curve_alone(run)
    else:
        found = find_curve(store, run, None if curve == "newest" else curve)
        if curve == "newest":
            run = replace(run, by_itself=(*run.by_itself, (found.title, found.unit)))
    return replace(run, curve=found.within(profile))


def run_with(store: "Store", profile: Profile, calibration_id: int | None) -> Run:
    """Return a run with the calibration of a stored number, None for none; it has no curve.

    Raises:
        ConfigError: profile and calibration do not fit each other.
        StoreError: there is no such calibration.
    """
    return _run(profile, None if calibration_id is None else store.calibration(calibration_id))


def run_of_sweep(store: "Store", sweep: Sweep, calibration: str | None = None) -> Run:
    """Return what the samples of a sweep are measured with; it has no curve.

    Args:
        store: where the calibrations are.
        sweep: its profile is that of the run.
        calibration: another calibration than that of the sweep, as in `open_run`.

    Raises:
        ConfigError: profile or calibration are of another version or of another rig.
        StoreError: there is no such calibration.
    """
    profile = stored_profile(sweep)
    if calibration is None:
        return run_with(store, profile, sweep.calibration_id)
    return open_run(store, profile, calibration, "none")


def find_curve(store: "Store", run: Run, curve_id: int | None = None) -> RunCurve:
    """Return the curve of a run: the one with a number, or the newest good one of the rig.

    Raises:
        CurveError: it is of another rig, of another arrangement of its cameras, or of another
            calibration.
        StoreError: there is none.
    """
    name, unit = run.profile.name, run.profile.unit
    stored = store.active_curve(name, unit) if curve_id is None else store.curve(curve_id)
    sweep = store.sweep(stored.sweep_id)
    require_matching(run, stored_profile(sweep), stored)
    rows = None if stored.row_errors is None else ROW_ERRORS_JSON.from_json(stored.row_errors)
    rms_mm = stored.holdout.get("rms_mm")
    return RunCurve(
        stored.id,
        Curve.from_json(stored.curve),
        stored.sweep_id,
        rows,
        holdout_rms_mm=rms_mm if isinstance(rms_mm, float) else None,
        camera=camera_identity(sweep),
        unit=stored.unit,
    )


def camera_identity(stored: Sweep | StoredCalibration) -> Mapping[str, object]:
    """Return what the camera of a sweep or a calibration said of itself; empty for nothing."""
    told = stored.devices.get("camera")
    return cast("Mapping[str, object]", told) if isinstance(told, Mapping) else {}


def stored_profile(stored: Sweep | StoredCalibration) -> Profile:
    """Return the profile that a sweep or a calibration was made with.

    Raises:
        ConfigError: it was written by a version with other keys.
    """
    what = "sweep" if isinstance(stored, Sweep) else "calibration"
    return parse_profile(dict(stored.profile), source=f"profile stored with {what} {stored.id}")


def stored_rig(store: "Store", calibration_id: int) -> CalibratedRig:
    """Return what a calibration found, and the rig that it is of.

    Raises:
        ConfigError: it was written by another version.
        StoreError: there is no such calibration.
    """
    stored = store.calibration(calibration_id)
    geometry = stored_geometry(stored)
    return CalibratedRig(stored_profile(stored), geometry, stored.quality)


def stored_geometry(stored: StoredCalibration) -> RigGeometry:
    """Return the cameras of a stored calibration.

    Raises:
        ConfigError: it was written by another version, or is one of lenslets.
    """
    if LENSLETS in stored.geometry:
        raise ConfigError(
            f"asked for the cameras of calibration {stored.id}, it is one of lenslets: their views "
            "are pinholes of one lens, at the places that the profile gives",
            advice=f"rig export SWEEP --format csv gives what a sweep of {stored.rig} measured, "
            "rig export FOLDER the depth of a capture",
        )
    return geometry_from_json(stored.geometry)


def newer_curve(store: "Store", run: Run, curve: CurveChoice) -> int | None:
    """Return the number of a curve that took the place of a run's since it was opened, if any.

    Args:
        store: where curves are.
        run: uses the curve that it was opened with to its end.
        curve: which it was to use; one that was chosen by its number stays the right one.
    """
    if curve != "newest":
        return None
    try:
        newest = store.active_curve(run.profile.name, run.profile.unit).id
    except StoreError:  # it was taken away
        return None
    return None if run.curve is not None and run.curve.id == newest else newest


def new_folder(store: "Store", kind: str, rig: str) -> Path:
    """Name a folder beside the database for a run that nobody named, by rig and UTC time."""
    return unused(store.frames.parent / kind / f"{rig}_{datetime.now(UTC):%Y%m%d-%H%M%S-%f}")


def optics_of(profile: Profile, calibration: StoredCalibration | None) -> Optics:
    """Return the optics of a stored calibration, or of none.

    Raises:
        ConfigError: the calibration is of another rig, of other views, of another stage, or of a
            version that this program does not read; or the rig has one view only.
    """
    profile.require_two_views("depth")
    if calibration is None:
        return nominal_optics(profile)
    if calibration.rig != profile.name:
        raise ConfigError(
            f"calibration {calibration.id} is of rig {calibration.rig}, asked to use it for "
            f"{profile.name}",
            advice="choose another with --calibration, or none",
        )
    if profile.camera.is_scan:
        _require_same_scan(profile, calibration)
    if LENSLETS in calibration.geometry:
        return nominal_optics(profile, calibration.id)
    geometry = geometry_from_json(calibration.geometry)
    if geometry.stage is not None:
        _require_same_stage(profile, calibration)
    return calibrated_optics(profile, geometry, calibration.id)


def require_matching(run: Run, calibrated: Profile, curve: StoredCurve) -> None:
    """Refuse a curve that was measured with another arrangement of cameras.

    Args:
        run: that is to use it.
        calibrated: the rig as it was when the curve was measured.
        curve: stored.

    Raises:
        CurveError: name, views or pitch differ, or it was measured with another calibration.
    """
    profile, now = run.profile, run.optics.calibration_id
    what = profile.first_difference(calibrated, ("name", "views", "pitch_mm"))
    if what is not None:
        there, here = getattr(calibrated, what), getattr(profile, what)
        shown = f"{there} there, {here} here" if what != "views" else "other places of views"
        raise CurveError(
            f"curve {curve.id} belongs to another rig: {what} differs ({shown})",
            advice=f"run `rig sweep {profile.name}` or choose with --curve",
        )
    if curve.calibration_id != now:
        raise CurveError(
            f"curve {curve.id} was measured with {_in_words(curve.calibration_id)}, asked to use "
            f"it with {_in_words(now)}: its slopes are others",
            advice=(
                f"run `rig fit {curve.sweep_id} --calibration {now or NO_CALIBRATION}`, or give "
                f"--calibration {curve.calibration_id or NO_CALIBRATION}"
            ),
        )


def _run(profile: Profile, calibration: StoredCalibration | None) -> Run:
    optics = optics_of(profile, calibration)
    return Run(_with_lenslets(profile, calibration), optics, None, calibration)


def _with_lenslets(profile: Profile, calibration: StoredCalibration | None) -> Profile:
    """The profile, with the calibrated array where its camera has lenslets.

    Raises:
        ConfigError: calibration and camera are not of one kind.
    """
    lenslets = None if calibration is None else calibration.geometry.get(LENSLETS)
    is_lenslet = isinstance(profile.camera, LensletCameraConfig)
    if calibration is None or (not is_lenslet and lenslets is None):
        return profile
    if not is_lenslet or lenslets is None:
        is_of = "cameras and their places" if lenslets is None else "lenslets"
        raise ConfigError(
            f"calibration {calibration.id} is one of {is_of}, camera.kind of {profile.name} is "
            f"{profile.camera.kind}",
            advice=f"run `rig calibrate {profile.name}`, or choose another with --calibration",
        )
    camera = profile.camera.model_copy(update={"lenslets": lenslets})
    return profile.model_copy(update={"camera": camera})


def _chosen_calibration(
    store: "Store", profile: Profile, choice: str | None
) -> StoredCalibration | None:
    if choice is None:
        return store.active_calibration(profile.name, profile.unit)
    if choice == NO_CALIBRATION:
        return None
    if not choice.isdigit():
        raise ConfigError(
            f"--calibration {choice}: no number",
            advice=f"give the number of a calibration, or {NO_CALIBRATION}",
        )
    return store.calibration(int(choice))


def _require_same_stage(profile: Profile, calibration: StoredCalibration) -> None:
    """Refuse stage positions that are counted otherwise than when the calibration was made."""
    then = calibration.profile.get("stage")
    if profile.stage is None or not isinstance(then, dict):
        return
    stage = profile.stage.model_dump(mode="json")
    for key in ("distance_at_machine_zero_mm", "direction"):
        if then.get(key) != stage.get(key):
            raise ConfigError(
                f"calibration {calibration.id} was made with stage.{key} = {then.get(key)}, now "
                f"it is {stage.get(key)}: its stage positions mean other places",
                advice="calibrate again",
            )


def _require_same_scan(profile: Profile, calibration: StoredCalibration) -> None:
    """Refuse the places of a camera that now goes to others, however near they are.

    Raises:
        ConfigError: positions, pitch or directions of its stages are not those of then.
    """
    now = profile.model_dump(mode="json", include={"views", "pitch_mm", "stages"})
    for key in ("views", "pitch_mm"):
        if calibration.profile.get(key) != now[key]:
            raise ConfigError(
                f"calibration {calibration.id} was made with other positions of the camera "
                f"({key} of the profile has changed since)",
                advice="calibrate again, or go back to those positions",
            )
    then = calibration.profile.get("stages")
    for name, stage in now["stages"].items():
        before = then.get(name) if isinstance(then, dict) else None
        if (before is None) != (stage is None) or _direction(before) != _direction(stage):
            raise ConfigError(
                f"calibration {calibration.id} was made with stages.{name} running in the "
                f"direction {_direction(before)}, now it is {_direction(stage)}",
                advice="calibrate again",
            )


def _direction(stage: object) -> object:
    return stage.get("direction") if isinstance(stage, dict) else None


def _in_words(calibration_id: int | None) -> str:
    return "no calibration" if calibration_id is None else f"calibration {calibration_id}"
