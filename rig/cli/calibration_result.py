"""The result of a calibration as JSON contract, and in words."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.calibrate.conclude import CalibrationResult
    from rig.calibrate.sight import Tally


def calibration_as_dict(result: "CalibrationResult") -> dict[str, object]:
    """Return what `--json` prints."""
    from rig.calibrate.conclude import quality_of

    calibration, verdict = result.calibration, result.calibration.verdict
    return {
        "calibration": result.calibration_id,
        "rig": result.rig,
        "database": result.database,
        "file": str(result.file),
        "report": str(result.report),
        "pictures": len(calibration.pictures),
        "found": dict(zip(result.tally.names, result.tally.found, strict=True)),
        "not_found": {
            name: dict(reasons)
            for name, reasons in zip(result.tally.names, result.tally.reasons, strict=True)
        },
        "depth_zero": _depth_zero(result),
        **quality_of(calibration, result.sliders),
        "readout_ms": {
            calibration.geometry.names[r.view]: {
                "value": 1e3 * r.readout_s,
                "k2": 2e3 * r.sigma_s,
                "rolling": r.is_rolling,
            }
            for r in result.readouts
        },
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


def _depth_zero(result: "CalibrationResult") -> str:
    """Where depth counts from, and how sure that is."""
    geometry = result.calibration.geometry
    reference = geometry.names[geometry.reference]
    zero = f"the optical centre of {reference}, along its optical axis"
    if geometry.stage is None:
        return f"{zero}; no stage took part, nothing outside the camera is tied to it"
    sigma_mm = float(geometry.stage.covariance[3, 3]) ** 0.5
    return (
        f"{zero}; at stage position 0 the target's middle is at {geometry.stage.zero_mm:.2f} "
        f"+- {2 * sigma_mm:.2f} mm (k=2)"
    )


def calibration_lines(result: "CalibrationResult") -> list[str]:
    """Return the result for a person, depth first."""
    from rig.calibrate.conclude import pose_text, slider_lines

    calibration, verdict = result.calibration, result.calibration.verdict
    if len(calibration.geometry.names) == 1:
        return _one_camera_lines(result)
    epipolar = calibration.epipolar
    errors = ", ".join(
        f"{error.seen_pct:.3f} % at {error.distance_mm / 1000:g} m"
        for error in calibration.depth_error
    )
    whole = ", ".join(f"{error.picture_pct:.3f}" for error in calibration.depth_error)
    lines = [
        f"calibration {result.calibration_id} of {result.rig}: {verdict}",
        f"depth error from calibration alone, k=2 where boards were seen: {errors or 'not known'}"
        + (f" (over the whole picture {whole} %)" if whole else ""),
        f"reprojection rms {calibration.rms_px:.3f} px, {calibration.held_out_rms_px:.3f} px "
        f"on held-out pictures; {len(calibration.pictures)} pictures, lens {calibration.lens}",
        f"epipolar error mean {epipolar.mean_px:.3f}, p95 {epipolar.p95_px:.3f}, "
        f"max {epipolar.max_px:.3f} px",
        f"depth counts from {_depth_zero(result)}",
        *_stage_lines(result),
        *([] if result.sliders is None else slider_lines(result.sliders)),
        *tally_lines(result.tally),
        *(f"note: {note}" for note in verdict.notes),
    ]
    if not verdict.good:
        lines += [f"would help: {pose_text(pose)}" for pose in verdict.poses]
    return [*lines, f"stored in {result.database}", f"report {result.report}"]


def _one_camera_lines(result: "CalibrationResult") -> list[str]:
    """The result of one camera alone: its lens first, as other tools tell it, with k = 2."""
    import numpy as np

    from rig.calibrate.conclude import quality_of

    calibration, verdict = result.calibration, result.calibration.verdict
    (camera,), covariance = calibration.geometry.cameras, calibration.geometry.covariance
    values = (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px)
    twice = [None] * 4 if covariance is None else (2 * np.sqrt(np.diag(covariance)[:4])).tolist()
    numbers = ", ".join(
        f"{name} {value:.2f}" + ("" if k2 is None else f" +- {k2:.2f}")
        for name, value, k2 in zip(("fx", "fy", "cx", "cy"), values, twice, strict=True)
    )
    error = quality_of(calibration).get("direction_error_px")
    told = error if isinstance(error, dict) else {}
    coefficients = ", ".join(f"{value:.6g}" for value in camera.coefficients)
    return [
        f"calibration {result.calibration_id} of {result.rig}: {verdict}",
        f"{numbers} px (k=2); lens {calibration.lens} {coefficients}".rstrip(),
        *(
            f"directions known to {error['seen']:.3f} px, k=2 where boards were seen (over the "
            f"whole picture {error['picture']:.3f}, at the worst place {error['worst']:.3f} px)"
            for error in (told,)
            if error
        ),
        f"reprojection rms {calibration.rms_px:.3f} px, {calibration.held_out_rms_px:.3f} px "
        f"on held-out pictures; {len(calibration.pictures)} pictures",
        *tally_lines(result.tally),
        *(f"note: {note}" for note in verdict.notes),
        f"stored in {result.database}",
        f"report {result.report}",
    ]


def _stage_lines(result: "CalibrationResult") -> list[str]:
    stage = result.calibration.geometry.stage
    if stage is None:
        return []
    import numpy as np

    sigma = 2 * np.sqrt(np.diag(stage.covariance))
    right_deg, down_deg = np.degrees(np.arctan2(stage.axis[:2], stage.axis[2]))
    return [
        f"stage axis {right_deg:+.3f} deg to the right, {down_deg:+.3f} deg down "
        f"(+- {np.degrees(sigma[0]):.3f}, {np.degrees(sigma[1]):.3f}), scale "
        f"{stage.scale:.5f} +- {sigma[2]:.5f} (k=2)"
    ]


def tally_lines(tally: "Tally") -> list[str]:
    """Say how often the target was found, one line per view."""
    return [
        f"{name}: target in {found} of {tally.pictures} pictures"
        + "".join(f", {count} {reason}" for reason, count in reasons.most_common())
        for name, found, reasons in zip(tally.names, tally.found, tally.reasons, strict=True)
    ]
