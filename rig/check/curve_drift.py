"""Judgement of the depth-slope curve: does one picture of the board still fit it?"""

import numpy as np

from rig.check.items import Item
from rig.errors import RigError
from rig.profile import Profile
from rig.stored import RunCurve

SURE = 3.0
"""Sigmas within which a difference is chance."""


def judge_curve_drift(
    curve: RunCurve | RigError,
    profile: Profile,
    *,
    distance_mm: float,
    slope_px: float,
    sigma_px: float,
) -> Item:
    """Compare the depth of the board by the newest curve with where the stage says it is.

    Args:
        curve: of this rig, or why there is none to compare with.
        profile: the rig; its quality gates say how much error is allowed.
        distance_mm: position of the stage.
        slope_px: slope of the board there, px per view step.
        sigma_px: its 1 sigma.
    """
    if isinstance(curve, RigError):
        return Item("curve", "skip", f"nothing to compare with: {curve.found}", curve.advice)
    number, law = curve.id, curve.curve
    depth_mm = float(law.depth_mm(np.array([slope_px]))[0])
    sigma_mm = float(law.depth_sigma_mm(np.array([slope_px]), np.array([sigma_px]))[0])
    if not np.isfinite(depth_mm):
        return Item(
            "curve",
            "fail",
            f"at {distance_mm:.1f} mm the slope {slope_px:.3f} px lies outside curve {number}, "
            f"valid {law.valid_mm[0]:.0f}-{law.valid_mm[1]:.0f} mm",
            "the rig has changed, or the stage does not stand where it says: sweep again",
        )
    error_mm = depth_mm - distance_mm
    allowed_mm = max(SURE * sigma_mm, profile.quality.holdout_max_pct / 100.0 * distance_mm)
    drifted = abs(error_mm) > allowed_mm
    return Item(
        "curve",
        "fail" if drifted else "pass",
        f"curve {number} sees the board {error_mm:+.3f} mm from where the stage has it, at "
        f"{distance_mm:.1f} mm; allowed {allowed_mm:.3f} mm",
        "camera, lens or reference switch have moved since the sweep: sweep again"
        if drifted
        else "",
        {"error_mm": error_mm, "allowed_mm": allowed_mm},
    )
