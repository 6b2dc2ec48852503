"""Judgement of the distances that the profile looks for: which slopes they are, and who knows."""

from rig.check.items import Item, failed
from rig.errors import ConfigError, CurveError, RigError
from rig.optics.search_range import search_range_px
from rig.stored import Run, RunCurve


def judge_range(run: Run, curve: RunCurve | RigError) -> Item:
    """Judge `slopes.range_mm`.

    Args:
        run: the rig, without a curve.
        curve: of a sweep, or why there is none.
    """
    near_mm, far_mm = run.profile.slopes.range_mm or (0.0, 0.0)
    asked = f"{near_mm:g}-{far_mm:g} mm"
    if run.awaits is not None and isinstance(curve, RigError):
        return Item("range", "skip", f"{asked}: only the device's own calibration may tell slopes")
    known = None if isinstance(curve, RigError) else curve
    try:
        low_px, high_px = search_range_px(
            run.profile, run.optics, None if known is None else known.curve
        )
        cut = None if known is None else known.within(run.profile)
    except (ConfigError, CurveError) as error:
        return failed("range", error)
    numbers = {"range_px": [low_px, high_px], "range_mm": [near_mm, far_mm]}
    title = "the calibration" if known is None else known.title
    found = f"{asked} are slopes of {low_px:.1f} to {high_px:.1f} px, by {title}"
    if cut is None or cut.proven_mm is None:
        return Item("range", "pass", found, numbers=numbers)
    valid_mm = cut.proven_mm
    if near_mm >= valid_mm[0] and far_mm <= valid_mm[1]:
        return Item("range", "pass", found, numbers=numbers)
    return Item(
        "range",
        "warn",
        f"{found}, which is valid {valid_mm[0]:.0f}-{valid_mm[1]:.0f} mm only",
        "no depth comes from outside of that: sweep it, or look for less",
        numbers,
    )
