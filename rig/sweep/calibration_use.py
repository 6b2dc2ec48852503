"""What a calibration meant for a sweep: where distances come from, and whether cameras agree."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.optics.calibrated import CalibratedOptics
from rig.optics.optics import Optics
from rig.sweep.points import StopResult


@dataclass(frozen=True, slots=True)
class StageUse:
    """The stage as a calibration knows it."""

    scale: float
    """True mm per mm."""
    axis_deg: float
    """Angle of its axis to the optical axis."""


@dataclass(frozen=True, slots=True)
class CalibrationUse:
    """A calibration beside the distances of a sweep."""

    id: int | None
    stage: StageUse | None
    """None where the calibration knows no stage and positions are taken as distances."""
    zero_sigma_mm: float | None
    """1 sigma of where depth zero is, for positions of the stage."""
    disagreement_pct: float | None
    """rms difference between depth by the cameras alone and by the stage, per cent; None without a
    stop."""


def seen_mm(optics: CalibratedOptics, slope_px: Float | float) -> Float:
    """Return the depth that the calibrated cameras alone give to slopes on their axis, mm."""
    rectification = optics.rectification
    return rectification.inverse_law_px_mm / (
        np.asarray(slope_px, np.float64) + rectification.infinity_px
    )


def calibration_use(stops: Sequence[StopResult], optics: Optics) -> CalibrationUse | None:
    """Return what the calibration meant for a sweep, None without one."""
    if not isinstance(optics, CalibratedOptics):
        return None
    rectification = optics.rectification
    stage = rectification.geometry.stage
    points = [stop.point for stop in stops if stop.point is not None]
    known_mm = np.array([point.distance_mm for point in points])
    slopes_px = np.array([point.slope_px for point in points])
    misses = seen_mm(optics, slopes_px) / known_mm - 1.0
    return CalibrationUse(
        id=optics.calibration_id,
        stage=None
        if stage is None
        else StageUse(stage.scale, float(np.degrees(np.arccos(min(1.0, float(stage.axis[2])))))),
        zero_sigma_mm=None if stage is None else float(np.sqrt(stage.covariance[3, 3])),
        disagreement_pct=100.0 * float(np.sqrt(np.mean(misses**2))) if points else None,
    )
