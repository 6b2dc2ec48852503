"""Whether the rows of a rig miss as they did when its curve was made.

A camera that turns moves its picture along the lines as far as across them. Across, no depth moves
anything, so that it shows in any scene; along, it is a slope that only a sweep can tell.
"""

from dataclasses import replace

import numpy as np

from rig.epipolar import RectifiedViews
from rig.epipolar.mending.mending import Mending
from rig.errors import CurveError
from rig.stored import Run, RunCurve

_DISTANCES = 65
_K = 2.0


def expecting_rows(run: Run, views: RectifiedViews) -> RectifiedViews:
    """Return views whose rows are expected to miss as they did when the curve of a run was made."""
    return views if run.curve is None else replace(views, row_errors=run.curve.row_errors)


def require_same_rows(run: Run, mending: Mending | None) -> None:
    """Refuse a curve whose slopes were measured with rows that missed otherwise.

    Args:
        run: with or without a curve.
        mending: what the estimator found of views of `expecting_rows`.

    Raises:
        CurveError: what the rows miss by beyond that may move slopes by more than the curve's own
            uncertainty, k=2. A curve of a calibration alone is less sure instead: see
            `widened_by_rows`.
    """
    curve, drift = run.curve, None if mending is None else mending.drift
    if curve is None or curve.alone is not None or drift is None:
        return
    change_px = drift.sure_px / np.maximum(drift.steps, 1e-9)
    worst = int(np.argmax(change_px))
    sigma_px = _sigma_px(curve)
    if change_px[worst] <= _K * sigma_px:
        return
    names = [view.name for view in run.profile.views]
    name = names[worst] if len(names) == len(change_px) else "a view"
    effect = (
        f"slopes may be off by {change_px[worst]:.3f} px, the curve knows them to "
        f"{_K * sigma_px:.2g} px (k=2)"
    )
    missed = f"{name} is {drift.left.worst[worst]}"
    if curve.row_errors is None:
        raise CurveError(
            f"{curve.title} was made without mending of rows, this rig's rows miss: {missed}; "
            f"{effect}",
            advice="sweep again"
            if curve.sweep_id is None
            else f"run `rig fit {curve.sweep_id}`, or sweep again",
        )
    raise CurveError(
        f"rows miss otherwise than when {curve.title} was made: {missed} beyond that; {effect}",
        advice=f"a camera has moved: run `rig sweep {run.profile.name}` again",
    )


def widened_by_rows(run: Run, mending: Mending) -> Run:
    """Return a run whose curve, where no sweep made it, is less sure by what the rows miss by.

    Args:
        run: with or without a curve.
        mending: of all its views.
    """
    if run.curve is None or run.curve.alone is None:
        return run
    return replace(run, curve=run.curve.widened(mending, run.optics))


def _sigma_px(curve: RunCurve) -> float:
    distances_mm = np.linspace(*curve.curve.valid_mm, _DISTANCES)
    return float(np.nanmax(curve.curve.curve_sigma_px(distances_mm)))
