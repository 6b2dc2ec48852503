"""What a calibration is worth, as values."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.calibrate.sight import Tally
from rig.geometry.bundle import Calibration
from rig.geometry.bundle.result import PoseAdvice


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """A calibration that has been stored."""

    calibration_id: int
    rig: str
    calibration: Calibration
    tally: Tally
    database: str
    file: Path
    """The whole calibration as JSON."""
    report: Path
    """Its pictures, one HTML file."""


def quality_of(calibration: Calibration) -> dict[str, object]:
    """Return the numbers that judge a calibration, as plain data."""
    epipolar = calibration.epipolar
    return {
        "lens": calibration.lens,
        "depth_error": [
            {
                "distance_mm": error.distance_mm,
                "seen_pct": error.seen_pct,
                "picture_pct": error.picture_pct,
                "worst_pct": error.worst_pct,
            }
            for error in calibration.depth_error
        ],
        "reprojection_px": {
            "fit_rms": calibration.rms_px,
            "held_out_rms": calibration.held_out_rms_px,
        },
        "motion": None
        if calibration.motion is None
        else {
            "shift_mm": calibration.motion.shift_mm,
            "turn_deg": float(np.degrees(calibration.motion.turn_rad)),
            "worst_scale": float(calibration.motion.picture_scale.max()),
        },
        "epipolar_px": {
            "mean": epipolar.mean_px,
            "p95": epipolar.p95_px,
            "max": epipolar.max_px,
        },
    }


def pose_text(pose: PoseAdvice) -> str:
    """A pose that would help, in words."""
    x_px, y_px = pose.centre_px
    about_x_deg, about_y_deg = pose.tilt_deg
    tilt = (
        f"tilted {about_x_deg:+.0f} deg about x, {about_y_deg:+.0f} deg about y"
        if about_x_deg or about_y_deg
        else "square-on"
    )
    return (
        f"target at {pose.distance_mm:.0f} mm, its middle at ({x_px:.0f}, {y_px:.0f}) px of the "
        f"reference view, {tilt}: depth error {pose.gain_pct:.0f} % smaller"
    )
