"""What a calibration is worth, as values."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.calibrate.sight import Tally
from rig.geometry.bundle import Calibration
from rig.geometry.bundle.direction_error import direction_error_of
from rig.geometry.bundle.result import PoseAdvice
from rig.geometry.bundle.rolling_shutter import Readout
from rig.geometry.slider import Sliders


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
    sliders: Sliders | None = None
    """What carries the camera; None where it stands."""
    readouts: tuple[Readout, ...] = ()
    """How long views take from their first row to their last, where moving boards tell."""


def error_text(calibration: Calibration) -> str:
    """The headline in words, k = 2 where boards were seen."""
    if len(calibration.geometry.names) == 1:
        return f"directions to {direction_error_of(calibration).seen_px:.3f} px"
    errors = ", ".join(
        f"{e.seen_pct:.3f} % at {e.distance_mm / 1000:g} m" for e in calibration.depth_error
    )
    return f"depth error {errors or 'not known'}"


def quality_of(calibration: Calibration, sliders: Sliders | None = None) -> dict[str, object]:
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
        **_directions(calibration),
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
        **({} if sliders is None else {"sliders": _as_dict(sliders)}),
        "epipolar_px": None
        if len(calibration.geometry.names) == 1
        else {
            "mean": epipolar.mean_px,
            "p95": epipolar.p95_px,
            "max": epipolar.max_px,
        },
    }


def _directions(calibration: Calibration) -> dict[str, object]:
    """What stands for the depth error of one camera alone."""
    if len(calibration.geometry.names) > 1 or calibration.geometry.covariance is None:
        return {}
    error = direction_error_of(calibration)
    return {
        "direction_error_px": {
            "seen": error.seen_px,
            "picture": error.picture_px,
            "worst": error.worst_px,
        }
    }


def _as_dict(sliders: Sliders) -> dict[str, object]:
    """Return the sliders as plain data, sigmas k = 2."""
    return {
        "lines": [
            {
                "along": line.along,
                "forward_deg": line.forward_deg,
                "forward_k2_deg": 2.0 * line.forward_sigma_deg,
                "roll_deg": line.roll_deg,
                "roll_k2_deg": 2.0 * line.roll_sigma_deg,
                "scale": line.scale,
                "scale_k2": 2.0 * line.scale_sigma,
            }
            for line in sliders.lines
        ],
        "straightness_mm": sliders.straightness_mm,
        "turn_deg": sliders.turn_deg,
        "off_line_mm": sliders.off_line_mm.tolist(),
        "place_k2_mm": (2.0 * sliders.place_sigma_mm).tolist(),
    }


def slider_lines(sliders: Sliders) -> list[str]:
    """Say what was found of the sliders, one line each and one for how straight they are."""
    told = [
        f"slider of the {line.along}: {line.roll_deg:+.3f} deg out of the {line.along}s "
        f"(+- {2 * line.roll_sigma_deg:.3f}), {line.forward_deg:+.3f} deg forward "
        f"(+- {2 * line.forward_sigma_deg:.3f}), scale {line.scale:.5f} +- "
        f"{2 * line.scale_sigma:.5f} (k=2)"
        for line in sliders.lines
    ]
    worst_um = 1e3 * float(np.linalg.norm(sliders.off_line_mm, axis=1).max())
    sigma_um = 2e3 * float(sliders.place_sigma_mm.max())
    return [
        *told,
        f"views off these lines by at most {worst_um:.1f} um, places +- {sigma_um:.1f} um (k=2); "
        f"the camera turns by {sliders.turn_deg:.4f} deg (rms) on the way",
    ]


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
