"""What a calibration is worth, in words and as data."""

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

    def as_dict(self) -> dict[str, object]:
        """The one JSON object of `rig calibrate`."""
        calibration, verdict = self.calibration, self.calibration.verdict
        return {
            "calibration": self.calibration_id,
            "rig": self.rig,
            "database": self.database,
            "file": str(self.file),
            "report": str(self.report),
            "pictures": len(calibration.pictures),
            "found": dict(zip(self.tally.names, self.tally.found, strict=True)),
            "not_found": {
                name: dict(reasons)
                for name, reasons in zip(self.tally.names, self.tally.reasons, strict=True)
            },
            "depth_zero": self.depth_zero(),
            **quality_of(calibration),
            "verdict": {
                "good": verdict.good,
                "reasons": [{"code": r.code, "text": r.text} for r in verdict.reasons],
                "notes": list(verdict.notes),
                "poses": [
                    {
                        "distance_mm": pose.distance_mm,
                        "centre_px": list(pose.centre_px),
                        "tilt_deg": list(pose.tilt_deg),
                        "gain_pct": pose.gain_pct,
                    }
                    for pose in verdict.poses
                ],
            },
        }

    def depth_zero(self) -> str:
        """Where depth counts from, and how sure that is."""
        geometry = self.calibration.geometry
        reference = geometry.names[geometry.reference]
        zero = f"the optical centre of {reference}, along its optical axis"
        if geometry.stage is None:
            return f"{zero}; no stage took part, nothing outside the camera is tied to it"
        sigma_mm = float(np.sqrt(geometry.stage.covariance[3, 3]))
        return (
            f"{zero}; at stage position 0 the target's middle is at {geometry.stage.zero_mm:.2f} "
            f"+- {2 * sigma_mm:.2f} mm (k=2)"
        )

    def lines(self) -> list[str]:
        """The same for people, depth first."""
        calibration, verdict = self.calibration, self.calibration.verdict
        epipolar = calibration.epipolar
        errors = ", ".join(
            f"{error.picture_pct:.3f} % at {error.distance_mm / 1000:g} m"
            for error in calibration.depth_error
        )
        lines = [
            f"calibration {self.calibration_id} of {self.rig}: {verdict}",
            f"depth error from calibration alone, k=2 over the picture: {errors or 'not known'}",
            f"reprojection rms {calibration.rms_px:.3f} px, {calibration.held_out_rms_px:.3f} px "
            f"on held-out pictures; {len(calibration.pictures)} pictures, lens {calibration.lens}",
            f"epipolar error mean {epipolar.mean_px:.3f}, p95 {epipolar.p95_px:.3f}, "
            f"max {epipolar.max_px:.3f} px",
            f"depth counts from {self.depth_zero()}",
            *self._stage_lines(),
            *self.tally.lines(),
            *(f"note: {note}" for note in verdict.notes),
        ]
        if not verdict.good:
            lines += [f"would help: {pose_text(pose)}" for pose in verdict.poses]
        return [*lines, f"stored in {self.database}", f"report {self.report}"]

    def _stage_lines(self) -> list[str]:
        stage = self.calibration.geometry.stage
        if stage is None:
            return []
        sigma = 2 * np.sqrt(np.diag(stage.covariance))
        right_deg, down_deg = np.degrees(np.arctan2(stage.axis[:2], stage.axis[2]))
        return [
            f"stage axis {right_deg:+.3f} deg to the right, {down_deg:+.3f} deg down "
            f"(+- {np.degrees(sigma[0]):.3f}, {np.degrees(sigma[1]):.3f}), scale "
            f"{stage.scale:.5f} +- {sigma[2]:.5f} (k=2)"
        ]


def quality_of(calibration: Calibration) -> dict[str, object]:
    """Return the numbers that judge a calibration, as plain data."""
    epipolar = calibration.epipolar
    return {
        "lens": calibration.lens,
        "depth_error": [
            {
                "distance_mm": error.distance_mm,
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
