"""Judgement of the pictures: board, focus, exposure, and how alike the views are."""

import statistics
from collections.abc import Sequence
from functools import partial

from rig.check.items import Item, Status, graded, worst
from rig.check.stills import ViewStills
from rig.errors import TargetError, every_advice
from rig.targets import CornersOrReason
from rig.targets.corners import Corners

SOFT_PX, BLURRED_PX = 1.5, 3.0
"""Blur of an edge (sigma, pixel area included). A lens in focus gives 0.5-1 px; the sigma of a
slope grows with the root of it, and past 3 px squares at the far end run together."""
UNEVEN_FOCUS = 1.5
"""Blur of a view over the median of all, above which one lens is out of focus."""
CLIPPED, BURNT = 0.005, 0.05
"""Share of saturated pixels on the board: edges of burnt squares are displaced."""
DIM, DARK = 0.25, 0.12
"""White of the board as a share of full scale."""
UNEQUAL_CONTRAST, UNLIKE_CONTRAST = 1.25, 2.0
"""Contrast of the board between two views."""


def judge_board(views: Sequence[ViewStills], where: str) -> Item:
    """Say which views see the board, and why the others do not."""
    missing = {v.view: v.board for v in views if not isinstance(v.board, Corners)}
    if not missing:
        return Item("board", "pass", f"found in all {len(views)} views {where}")
    by_reason: dict[str, list[str]] = {}
    for view, reason in missing.items():
        by_reason.setdefault(reason.found, []).append(view)
    return Item(
        "board",
        "fail",
        f"not found in {len(missing)} of {len(views)} views {where}: "
        + "; ".join(f"{', '.join(names)}: {text}" for text, names in by_reason.items()),
        every_advice(missing.values()),
        {"reason": {view: reason.reason for view, reason in missing.items()}},
    )


def judge_focus(views: Sequence[ViewStills]) -> Item:
    """Judge the sharpness of the board's edges."""
    blur_px = {v.view: v.board.blur_px for v in views if isinstance(v.board, Corners)}
    refused = [v.view for v in views if _is_blurred(v.board)]
    if refused:
        return Item(
            "focus",
            "fail",
            f"edges of the board too blurred to measure in {', '.join(refused)}",
            f"focus {', '.join(refused)} on the middle of the travel and lock the lens",
            {"blur_px": blur_px},
        )
    if not blur_px:
        return _without_board("focus")
    median_px = statistics.median(blur_px.values())
    status = worst([graded(b, warn_above=SOFT_PX, fail_above=BLURRED_PX) for b in blur_px.values()])
    soft = [view for view, b in blur_px.items() if b > SOFT_PX or b > UNEVEN_FOCUS * median_px]
    if soft and status == "pass":
        status = "warn"
    return Item(
        "focus",
        status,
        f"edges blurred by {_by_view(blur_px, '{:.2f}')} px (sigma)",
        f"focus {', '.join(soft)} on the middle of the travel and lock the lens" if soft else "",
        {"blur_px": blur_px},
    )


def judge_exposure(views: Sequence[ViewStills]) -> Item:
    """Judge clipping at both ends of the scale, where the board is."""
    statuses: list[Status] = []
    found: list[str] = []
    advice: list[str] = []
    for view in views:
        exposure = view.exposure
        white, black = (exposure.white / exposure.full_scale, exposure.black / exposure.full_scale)
        bright = graded(exposure.saturated_share, warn_above=CLIPPED, fail_above=BURNT)
        dim = graded(-white, warn_above=-DIM, fail_above=-DARK)
        empty = graded(exposure.empty_share, warn_above=CLIPPED, fail_above=1.0)
        statuses.extend((bright, dim, empty))
        text = f"{view.view} {black:.0%}-{white:.0%}"
        if bright != "pass":
            text += f" with {exposure.saturated_share:.1%} saturated"
            advice.append(f"{view.view}: shorten the exposure, lower the gain, or dim the light")
        if dim != "pass":
            advice.append(f"{view.view}: lengthen the exposure or add light")
        elif empty != "pass":
            text += f" with {exposure.empty_share:.1%} at zero"
            advice.append(f"{view.view}: raise the black level, or add light to the dark squares")
        found.append(text)
    return Item(
        "exposure",
        worst(statuses),
        f"black to white, of full scale: {', '.join(found)}",
        "; ".join(advice),
        {"saturated_share": {v.view: v.exposure.saturated_share for v in views}},
    )


def judge_likeness(views: Sequence[ViewStills]) -> Item:
    """Judge gain and offset of the views against the first that sees the board."""
    seeing = [v for v in views if isinstance(v.board, Corners)]
    if len(seeing) < 2:
        return _without_board("likeness")
    contrast = {v.view: v.exposure.white - v.exposure.black for v in seeing}
    median = statistics.median(contrast.values())
    full_scale = seeing[0].exposure.full_scale
    gains = {view: value / median for view, value in contrast.items()}
    offsets = {v.view: (v.exposure.black - seeing[0].exposure.black) / full_scale for v in seeing}
    grade = partial(graded, warn_above=UNEQUAL_CONTRAST, fail_above=UNLIKE_CONTRAST)
    odd = [view for view, gain in gains.items() if grade(max(gain, 1.0 / gain)) != "pass"]
    return Item(
        "likeness",
        worst([grade(max(gain, 1.0 / gain)) for gain in gains.values()]),
        f"contrast over its median: {_by_view(gains, '{:.2f}')}; "
        f"black against {seeing[0].view}: {_by_view(offsets, '{:+.1%}')}",
        f"give {', '.join(odd)} the exposure, gain and aperture of the others" if odd else "",
        {"contrast_ratio": gains, "black_difference": offsets},
    )


def _is_blurred(board: CornersOrReason) -> bool:
    return isinstance(board, TargetError) and board.reason == "blurred"


def _without_board(name: str) -> Item:
    return Item(name, "skip", "needs the board in the picture")


def _by_view(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{view} {form.format(value)}" for view, value in values.items())
