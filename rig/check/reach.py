"""How the board looks over the travel: its size, and whether it stays in the picture.

Along the stage's travel every point of the board runs on a straight line through space, so its
image is linear in the inverse of the distance: two pictures tell all others.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.check.items import Item, Status, worst
from rig.targets.checkerboard_diagnosis import MIN_SIDE_PX
from rig.targets.corners import Corners

BORDER_PX = 4.0
"""A corner nearer to the border than this cannot be fitted."""
SMALL = 1.3
"""Squares up to so many times the least size are small: noise moves their corners."""
_PLACES = 400


@dataclass(frozen=True, slots=True)
class Reach:
    """Where one view can measure the board, within the plan."""

    view: str
    nearest_mm: float
    """Where it leaves the picture, or the near end of the plan. NaN where it is never inside."""
    farthest_mm: float
    """Where squares become too small or it leaves the picture, or the far end. NaN as above."""
    side_px: tuple[float, float]
    """Side of a square at the near and at the far end of the plan."""


def predict_reach(
    view: str,
    corners_at_mm: Mapping[float, Corners],
    *,
    plan_mm: tuple[float, float],
    size_px: tuple[int, int],
) -> Reach:
    """Predict where in the plan a view sees all of the board, and large enough.

    From one distance alone the picture is taken to grow from its centre; from two or more it is
    known from where it grows.

    Args:
        view: its name.
        corners_at_mm: of the board in that view, by its distance; one or more.
        plan_mm: nearest and farthest distance of the plan.
        size_px: width and height of the picture.
    """
    inverse = np.array([1.0 / distance_mm for distance_mm in corners_at_mm])
    corners_px = np.stack([corners.xy_px.reshape(-1) for corners in corners_at_mm.values()])
    if len(inverse) > 1:
        design = np.stack([np.ones_like(inverse), inverse], axis=-1)
        start, rise = np.linalg.lstsq(design, corners_px, rcond=None)[0]
    else:
        start = np.tile((np.array(size_px) - 1) / 2.0, corners_px.shape[1] // 2)
        rise = (corners_px[0] - start) / inverse[0]
    near_mm, far_mm = plan_mm
    places_mm = 1.0 / np.linspace(1.0 / near_mm, 1.0 / far_mm, _PLACES)
    xy_px = (start + rise / places_mm[:, None]).reshape(_PLACES, -1, 2)
    last = np.array(size_px) - 1.0
    inside = ((xy_px >= BORDER_PX) & (xy_px <= last - BORDER_PX)).all(axis=(1, 2))
    product = float(np.mean([corners.side_px * z_mm for z_mm, corners in corners_at_mm.items()]))
    good = places_mm[inside & (product / places_mm >= MIN_SIDE_PX)]
    return Reach(
        view,
        nearest_mm=float(good.min()) if len(good) else float("nan"),
        farthest_mm=float(good.max()) if len(good) else float("nan"),
        side_px=(product / near_mm, product / far_mm),
    )


def judge_reach(
    reaches: Sequence[Reach],
    *,
    reference: str,
    plan_mm: tuple[float, float],
    visited_mm: Sequence[float],
) -> Item:
    """Judge whether the board can be measured over the whole plan.

    A stop needs the reference view and one more; every further view makes its slope better.
    """
    if not reaches:
        return Item("reach", "skip", "needs the board in the picture at a known distance")
    near_mm, far_mm = plan_mm
    slack_mm = 1e-6 * far_mm
    statuses: list[Status] = []
    advice: list[str] = []
    short = [
        r for r in reaches
        if not (r.nearest_mm <= near_mm + slack_mm and r.farthest_mm >= far_mm - slack_mm)
    ]  # fmt: skip
    whole = [r.view for r in reaches if r not in short]
    if short:
        blocked = reference not in whole or len(whole) < 2
        statuses.append("fail" if blocked else "warn")
        nearest_mm = max(r.nearest_mm for r in short)
        farthest_mm = min(r.farthest_mm for r in short)
        if nearest_mm > near_mm + slack_mm:
            advice.append(
                f"start at {np.ceil(nearest_mm):.0f} mm (sweep.from_mm), centre the board in all "
                "views, or use a smaller board"
            )
        if farthest_mm < far_mm - slack_mm:
            advice.append(
                f"end at {np.floor(farthest_mm):.0f} mm (sweep.to_mm), or use larger squares"
            )
        if not np.isfinite([nearest_mm, farthest_mm]).all():
            advice.append("no distance of the plan suits every view: move board or camera")
    small = min(r.side_px[1] for r in reaches)
    if small < SMALL * MIN_SIDE_PX:
        statuses.append("warn")
        if not advice:
            advice.append("use larger squares for a better far end")
    lost = "; ".join(_words(r, plan_mm) for r in short)
    basis = ", ".join(f"{mm:.0f}" for mm in sorted(set(visited_mm)))
    found = (
        f"squares of {max(r.side_px[0] for r in reaches):.1f} px at {near_mm:.0f} mm, "
        f"{small:.1f} px at {far_mm:.0f} mm"
    )
    return Item(
        "reach",
        worst([*statuses, "pass"]),
        found + (f"; {lost}" if lost else "; in every view") + f" (from pictures at {basis} mm)",
        "; ".join(advice),
        {
            "nearest_mm": {r.view: r.nearest_mm for r in reaches},
            "farthest_mm": {r.view: r.farthest_mm for r in reaches},
        },
    )


def _words(reach: Reach, plan_mm: tuple[float, float]) -> str:
    if not np.isfinite(reach.nearest_mm):
        return f"{reach.view} sees the whole board nowhere in the plan"
    words: list[str] = []
    if reach.nearest_mm > plan_mm[0]:
        words.append(f"nearer than {reach.nearest_mm:.0f} mm")
    if reach.farthest_mm < plan_mm[1]:
        words.append(f"beyond {reach.farthest_mm:.0f} mm")
    return f"{reach.view} loses it {' and '.join(words)}"
