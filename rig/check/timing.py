"""Judgement of time: skew between the views, frame rate, dropped frames, and settling."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.check.items import Item, graded, worst
from rig.check.stills import ViewStills
from rig.frames import MultiView

SLOW, CRAWLING = 0.05, 0.5
"""Missing share of the frame rate that was asked for."""
SOME_LOST, MANY_LOST = 0.01, 0.2
"""Share of the multi-views that were dropped."""


@dataclass(frozen=True, slots=True)
class Stream:
    """What a short stream showed."""

    times_s: tuple[float, ...]
    """Of the multi-views that came, s."""
    skews_s: tuple[float, ...]
    dropped: Mapping[str, int]
    """Multi-views dropped meanwhile, by reason."""
    missing_numbers: int
    """Largest count of sequence numbers that no frame of a view had."""

    @property
    def rate_hz(self) -> float | None:
        """Multi-views per second; None from fewer than two."""
        if len(self.times_s) < 2 or self.times_s[-1] <= self.times_s[0]:
            return None
        return (len(self.times_s) - 1) / (self.times_s[-1] - self.times_s[0])


def stream_of(multiviews: Sequence[MultiView], dropped: Mapping[str, int]) -> Stream:
    """Return what a stream showed.

    Args:
        multiviews: as they came.
        dropped: multi-views dropped meanwhile, by reason.
    """
    numbers = [[frame.sequence for frame in m.frames] for m in multiviews]
    gaps = np.diff(np.array(numbers), axis=0) - 1
    return Stream(
        times_s=tuple(m.timestamp_s for m in multiviews),
        skews_s=tuple(m.skew_s for m in multiviews),
        dropped={reason: count for reason, count in dropped.items() if count > 0},
        missing_numbers=int(np.maximum(gaps, 0).sum(axis=0).max(initial=0)),
    )


def judge_skew(
    skews_s: Sequence[float], max_skew_s: float, *, is_one_picture: bool = False
) -> Item:
    """Judge the time between the exposures of one multi-view.

    Args:
        skews_s: of the multi-views.
        max_skew_s: what the profile allows.
        is_one_picture: whether all views are parts of one picture.
    """
    if not skews_s:
        return Item("skew", "skip", "needs multi-views")
    if is_one_picture:
        found = f"0 ms: all views come in one picture ({len(skews_s)} multi-views)"
        return Item("skew", "pass", found, "", {"p50_ms": 0.0, "p95_ms": 0.0, "max_ms": 0.0})
    p50_ms, p95_ms, max_ms = 1e3 * np.percentile(skews_s, [50.0, 95.0, 100.0])
    status = graded(p95_ms, warn_above=0.5e3 * max_skew_s, fail_above=1e3 * max_skew_s)
    return Item(
        "skew",
        status,
        f"{p50_ms:.2f} ms median, {p95_ms:.2f} ms 95th percentile, {max_ms:.2f} ms at most; "
        f"allowed {1e3 * max_skew_s:.2f} ms ({len(skews_s)} multi-views)",
        "" if status == "pass" else "use hardware sync; a moving scene needs views of one instant",
        {"p50_ms": float(p50_ms), "p95_ms": float(p95_ms), "max_ms": float(max_ms)},
    )


def judge_rate(stream: Stream, asked_hz: float | None) -> Item:
    """Judge the frame rate against the one that was asked for."""
    if asked_hz is None:
        return Item("rate", "skip", "stored images have no frame rate")
    reached_hz = stream.rate_hz
    if reached_hz is None:
        return Item(
            "rate",
            "fail",
            f"asked for {asked_hz:.1f} multi-views per s, {len(stream.times_s)} came",
            "check cables and power; see the items above",
        )
    missing = 1.0 - reached_hz / asked_hz
    status = graded(missing, warn_above=SLOW, fail_above=CRAWLING)
    return Item(
        "rate",
        status,
        f"{reached_hz:.2f} multi-views per s, asked for {asked_hz:.2f}",
        ""
        if status == "pass"
        else "lower the rate or the picture size, use another USB controller, or expose shorter",
        {"reached_hz": reached_hz, "asked_hz": asked_hz},
    )


def judge_drops(stream: Stream) -> Item:
    """Judge how many multi-views were dropped, and say why."""
    kept, dropped = len(stream.times_s), sum(stream.dropped.values())
    unexplained = max(0, stream.missing_numbers - dropped)
    reasons = [f"{count} {reason}" for reason, count in stream.dropped.items()]
    if unexplained:
        reasons.append(f"{unexplained} missing in the sequence numbers")
    share = (dropped + unexplained) / max(1, kept + dropped + unexplained)
    status = graded(share, warn_above=SOME_LOST, fail_above=MANY_LOST)
    return Item(
        "drops",
        status,
        f"{kept} multi-views kept, dropped: {', '.join(reasons) or 'none'}",
        ""
        if status == "pass"
        else "spread the cameras over USB controllers, lower rate or size; for skew use hardware "
        "sync",
        {"kept": kept, "dropped": dict(stream.dropped), "unexplained": unexplained},
    )


def judge_settling(views: Sequence[ViewStills], *, settle_s: float, allowed_px: float) -> Item:
    """Judge whether the board stood still after a long move and `settle_s`."""
    motion_px = {v.view: v.motion_px for v in views if v.motion_px is not None}
    if not motion_px:
        return Item("settling", "skip", "needs the board in the picture")
    worst_view = max(motion_px, key=lambda view: motion_px[view])
    found_px = motion_px[worst_view]
    status = worst([graded(found_px, warn_above=0.5 * allowed_px, fail_above=allowed_px)])
    return Item(
        "settling",
        status,
        f"corners moved {found_px:.3f} px (view {worst_view}) between first and last sample of a "
        f"stop, {settle_s:.2f} s after a move; allowed {allowed_px:.3f} px",
        "" if status == "pass" else "raise sweep.settle_s, move gently, or look for vibration",
        {"motion_px": motion_px, "allowed_px": allowed_px},
    )
