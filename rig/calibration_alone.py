"""Depth without a sweep: the curve of a calibration alone, stored or the device's own."""

from collections.abc import Mapping
from dataclasses import replace

from rig.errors import CalibrationError, CurveError, StoreError
from rig.factory import FactoryCalibrated, changed_calibration
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.optics.calibrated_curve import curve_of_calibration
from rig.optics.factory import factory_geometry
from rig.optics.prior import FACTORY, PRIOR_SIGMAS, UNKNOWN_SOURCE, prior_covariance
from rig.run import Run, RunCurve, calibration_in_words


def completed_run(run: Run, device: object) -> Run:
    """Return a run with what its opened device itself says of its cameras, where it awaits that.

    Raises:
        ConfigError: the device's calibration does not fit the rig.
        CurveError: nowhere does it know depth as well as the profile asks for.
        StoreError: the device holds none.
    """
    if run.awaits is None:
        return run
    cameras = device.factory_calibration if isinstance(device, FactoryCalibrated) else None
    if cameras is None:
        name = run.profile.name
        raise StoreError(
            f"asked for the {run.awaits} of rig {name}: no curve and no calibration of it are "
            "stored, and the device holds none of its own",
            advice=f"run `rig calibrate {name}` or `rig import {name} FILE`; with a stage `rig "
            f"sweep {name}`",
        )
    optics = calibrated_optics(run.profile, factory_geometry(run.profile, cameras), None)
    known = Run(run.profile, optics)
    if run.awaits == "slopes":
        return known
    return replace(known, curve=curve_alone(known).within(run.profile))


def require_same_calibration(run: Run, identity: Mapping[str, str]) -> None:
    """Refuse a curve that was made while the device held another calibration of its own.

    A device that has calibrated itself anew found its cameras elsewhere than they were.

    Args:
        run: with its curve.
        identity: of the opened camera.

    Raises:
        CurveError: the device's own calibration has changed.
    """
    curve = run.curve
    changed = None if curve is None else changed_calibration(curve.camera, identity)
    if curve is None or changed is None:
        return
    before, now = str(curve.camera[changed]), identity[changed]
    raise CurveError(
        f"{curve.title} was made while the device held the calibration {before[:8]}..., it holds "
        f"{now[:8]}... now: it was calibrated anew or written since",
        advice=f"run `rig check {run.profile.name}`, then `rig sweep {run.profile.name}`; or write "
        "the calibration of then back into the device",
    )


def curve_alone(run: Run) -> RunCurve:
    """Return the curve that the calibration of a run gives by itself, without any sweep.

    Raises:
        CalibrationError: the run has no calibration.
        CurveError: nowhere does it know depth as well as the profile asks for.
    """
    profile, stored = run.profile, run.calibration
    if not isinstance(run.optics, CalibratedOptics):
        raise CalibrationError(
            f"asked for the curve of a calibration alone, rig {profile.name} has none",
            advice=f"run `rig calibrate {profile.name}` or `rig import {profile.name} FILE`",
        )
    rectification = run.optics.rectification
    covariance = rectification.geometry.covariance
    if covariance is None:
        by_source = FACTORY if stored is None else str(stored.quality.get("imported"))
        sigma = profile.prior_sigma or PRIOR_SIGMAS.get(by_source, UNKNOWN_SOURCE)
        covariance = prior_covariance(rectification.geometry, sigma)
    source = FACTORY if stored is None else f"calibration {stored.id}"
    curve = curve_of_calibration(
        rectification,
        covariance,
        max_sigma_pct=profile.quality.depth_sigma_pct,
        source=calibration_in_words(source),
    )
    camera = {} if stored is None else stored.devices.get("camera")
    known = dict(camera) if isinstance(camera, Mapping) else {}
    return RunCurve(None, curve, None, alone=source, camera=known)
