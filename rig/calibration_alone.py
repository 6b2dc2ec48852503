"""Depth without a sweep: the curve of a calibration alone, stored or the device's own."""

from dataclasses import replace

from rig.errors import CalibrationError, StoreError
from rig.factory import FactoryCalibrated
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
    return RunCurve(None, curve, None, alone=source)
