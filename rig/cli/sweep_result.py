"""The result of a sweep as JSON contract, and in words."""

from dataclasses import asdict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.sweep.alignment import Alignment, Angles
    from rig.sweep.calibration_use import CalibrationUse
    from rig.sweep.conclude import SweepResult

_LITTLE_DEG = 0.05
"""Angles below which nothing needs to be turned: a cosine error of 4e-7."""


def result_as_dict(result: "SweepResult") -> dict[str, object]:
    """Return what `--json` prints."""
    curve, use = result.fit.best, result.calibration
    return {
        "sweep": result.sweep_id,
        "database": result.database,
        "report": str(result.report),
        "points": [asdict(stop.point) for stop in result.stops if stop.point is not None],
        "curve": {
            "id": result.curve_id,
            "model": curve.model,
            "params": curve.params,
            "focus_mm": curve.focus_mm,
            "valid_mm": list(curve.valid_mm),
        },
        "holdout": result.holdout or None,
        "depth_error": _depth_error(result),
        "failed_gates": list(result.failed_gates),
        "alignment": alignment_as_dict(result.alignment),
        "epipolar_px": result.epipolar_px,
        "rows": list(result.row_lines),
        "calibration": None if use is None else use_as_dict(use),
        "times": None if result.times is None else asdict(result.times),
    }


def _depth_error(result: "SweepResult") -> dict[str, object] | None:
    """Return the errors of the headline; None where nothing was held out."""
    if not result.headline.errors:
        return None
    plane, pixels = result.headline.errors[0], result.headline.pixels
    return {
        "at_mm": plane.distance_mm,
        "k": 2,
        "board_plane_mm": plane.expanded_mm,
        "pixel_median_mm": pixels[0].expanded_mm if pixels else None,
    }


def result_lines(result: "SweepResult") -> list[str]:
    """Return the result for a person, the most important first."""
    curve, holdout = result.fit.best, result.fit.holdout
    lines = [f"{result.rig}: {result.headline}"]
    if holdout is not None:
        lines.append(
            f"held-out distances: rms {holdout.rms_pct:.4f} % ({holdout.rms_mm:.3f} mm), "
            f"largest {holdout.max_pct:.4f} %, bias {holdout.bias_pct:+.4f} %"
        )
    focus = "outside the sweep"
    if curve.focus_mm is not None and curve.focus_sigma_mm is not None:
        focus = f"{curve.focus_mm:.2f} +- {2.0 * curve.focus_sigma_mm:.2f} mm (k=2)"
    lines.append(f"curve {result.curve_id}: {curve.model}, focus distance {focus}")
    if result.calibration is not None:
        lines += use_lines(result.calibration)
    if (errors := result.epipolar_px) is not None:
        lines.append(
            f"epipolar error: mean {errors['mean']:.3f} px, 95th percentile "
            f"{errors['p95']:.3f} px, largest {errors['max']:.3f} px"
        )
    lines += result.row_lines
    lines += alignment_lines(result.alignment)
    lines += [f"note: {warning}" for warning in result.fit.warnings]
    if result.times is not None:
        from rig.report.times import times_text

        lines.append(times_text(result.times))
    lines.append(f"sweep {result.sweep_id} in {result.database}")
    lines.append(f"report: {result.report}")
    return lines


def use_as_dict(use: "CalibrationUse") -> dict[str, object]:
    """Return what a calibration meant, as `--json` prints it."""
    return {
        "id": use.id,
        "stage": None if use.stage is None else asdict(use.stage),
        "zero_sigma_mm": use.zero_sigma_mm,
        "cameras_against_stage_pct": use.disagreement_pct,
    }


def use_lines(use: "CalibrationUse") -> list[str]:
    """Say what a calibration meant."""
    where = "distances are positions of the stage as it reads them"
    if use.stage is not None and use.zero_sigma_mm is not None:
        where = (
            f"distances by its stage: scale {use.stage.scale:.5f}, axis "
            f"{use.stage.axis_deg:.2f} deg off the "
            f"optical axis, zero known to {2.0 * use.zero_sigma_mm:.3f} mm (k=2)"
        )
    lines = [f"calibration {use.id}: {where}"]
    if use.disagreement_pct is not None:
        lines.append(
            "depth by the cameras of the calibration alone: differs by "
            f"{use.disagreement_pct:.4f} % rms"
        )
    return lines


def alignment_as_dict(alignment: "Alignment") -> dict[str, object]:
    """Return what there is to turn, as `--json` prints it."""
    return {
        "board": _angles_as_dict(alignment.board),
        "stage": _angles_as_dict(alignment.stage),
        "calibrated": alignment.is_calibrated,
    }


def alignment_lines(alignment: "Alignment") -> list[str]:
    """Say what to turn, and by how much."""
    lines: list[str] = []
    if alignment.board is not None:
        lines.append(
            "board: "
            + _said(alignment.board, "right side", "lower side", "farther", "nearer")
            + _advice(alignment.board, "turn it back by as much to stand square to the axis")
        )
    if alignment.stage is not None:
        middle = "" if alignment.is_calibrated else ", if that passes the middle of the picture"
        lines.append(
            "stage: moving away it goes "
            + _directions(alignment.stage)
            + f" of the optical axis{middle}"
            + _advice(alignment.stage, "turn it back by as much to run along the axis")
        )
    return lines


def _angles_as_dict(angles: "Angles | None") -> dict[str, object] | None:
    if angles is None:
        return None
    return {
        "right_deg": angles.right_deg,
        "down_deg": angles.down_deg,
        "sigma_deg": list(angles.sigma_deg),
    }


def _said(angles: "Angles", right: str, down: str, more: str, less: str) -> str:
    parts = [
        f"{side} {abs(angle):.2f} +- {2.0 * sigma:.2f} deg {more if angle > 0 else less}"
        for side, angle, sigma in (
            (right, angles.right_deg, angles.sigma_deg[0]),
            (down, angles.down_deg, angles.sigma_deg[1]),
        )
    ]
    return " and ".join(parts) + " (k=2)"


def _directions(angles: "Angles") -> str:
    return (
        f"{abs(angles.right_deg):.2f} +- {2.0 * angles.sigma_deg[0]:.2f} deg "
        f"{'right' if angles.right_deg > 0 else 'left'} and {abs(angles.down_deg):.2f} +- "
        f"{2.0 * angles.sigma_deg[1]:.2f} deg {'below' if angles.down_deg > 0 else 'above'} (k=2)"
    )


def _advice(angles: "Angles", what: str) -> str:
    pairs = zip((angles.right_deg, angles.down_deg), angles.sigma_deg, strict=True)
    worth = any(abs(angle) > max(_LITTLE_DEG, 2.0 * sigma) for angle, sigma in pairs)
    return f"; {what}" if worth else "; nothing to turn"
