"""Judgement of the stage: does the travel cover the plan, and does the board come back?"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.check.items import Item, graded
from rig.profile import Profile

SMALL_SHARE = 1.0 / 3.0
"""Share of the depth error allowed by the profile that the stage may use up without a word."""
SURE = 3.0
"""Sigmas above which a difference between directions is believed."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """One arrival of the board at the same wanted position."""

    from_near: bool
    """Whether it came from the near side."""
    reached_mm: float
    """Position read back."""
    slope_px: float | None
    """Slope of the board as the camera sees it; None where it gave none."""
    sigma_px: float | None


@dataclass(frozen=True, slots=True)
class Repeatability:
    """How well the board comes back to one position."""

    wanted_mm: float
    arrivals: int
    read_back_mm: float
    """Largest distance of a position read back from the wanted one."""
    spread_mm: float | None
    """1 sigma of the board's place among arrivals from one side, as the camera sees it, the
    camera's own noise included; None without the camera."""
    resolved_mm: float | None
    """1 sigma that the camera's own noise puts on one arrival."""
    play_mm: float | None
    """Board coming from the far side minus board coming from the near side."""
    play_sigma_mm: float | None


def repeatability(
    wanted_mm: float, arrivals: Sequence[Arrival], slope_per_mm: float | None
) -> Repeatability:
    """Turn arrivals into mm.

    Args:
        wanted_mm: where the board was sent, again and again.
        arrivals: from both sides.
        slope_per_mm: change of the slope per mm of distance there, px per view step; negative.
    """
    read_back_mm = max(abs(a.reached_mm - wanted_mm) for a in arrivals)
    sides = [
        np.array([a.slope_px for a in arrivals if a.slope_px is not None and a.from_near == near])
        for near in (True, False)
    ]
    if slope_per_mm is None or any(len(side) < 2 for side in sides):
        return Repeatability(wanted_mm, len(arrivals), read_back_mm, None, None, None, None)
    near, far = (side / slope_per_mm for side in sides)
    variance = (near.var(ddof=1) * (len(near) - 1) + far.var(ddof=1) * (len(far) - 1)) / (
        len(near) + len(far) - 2
    )
    sigmas_px = [a.sigma_px for a in arrivals if a.sigma_px is not None]
    return Repeatability(
        wanted_mm,
        len(arrivals),
        read_back_mm,
        spread_mm=math.sqrt(variance),
        resolved_mm=float(np.median(sigmas_px)) / abs(slope_per_mm) if sigmas_px else None,
        play_mm=float(far.mean() - near.mean()),
        play_sigma_mm=math.sqrt(variance * (1.0 / len(near) + 1.0 / len(far))),
    )


def judge_travel(plan_mm: tuple[float, float], travel_mm: tuple[float, float]) -> Item:
    """Judge whether the stage reaches every distance of the plan."""
    covered = travel_mm[0] <= plan_mm[0] and plan_mm[1] <= travel_mm[1]
    return Item(
        "travel",
        "pass" if covered else "fail",
        f"plan from {plan_mm[0]:.1f} to {plan_mm[1]:.1f} mm, travel from {travel_mm[0]:.1f} to "
        f"{travel_mm[1]:.1f} mm",
        ""
        if covered
        else "choose sweep.from_mm and sweep.to_mm inside stage.travel_mm, or correct the travel",
    )


def judge_repeatability(figures: Repeatability, profile: Profile) -> Item:
    """Judge the place of the board against the depth error that the profile allows."""
    allowed_mm = profile.quality.holdout_rms_pct / 100.0 * figures.wanted_mm
    read = f"{figures.arrivals} arrivals at {figures.wanted_mm:.1f} mm read back within " + (
        f"{figures.read_back_mm:.3f} mm"
    )
    if figures.spread_mm is None or figures.play_mm is None or figures.play_sigma_mm is None:
        return Item(
            "repeatability",
            "warn",
            f"{read}; the camera gave no slopes to compare with",
            "see the board item; what a stage reads back does not show a loose board",
        )
    play_mm = abs(figures.play_mm) if abs(figures.play_mm) > SURE * figures.play_sigma_mm else 0.0
    loose_mm = math.sqrt(max(0.0, figures.spread_mm**2 - (figures.resolved_mm or 0.0) ** 2))
    status = graded(
        max(loose_mm, play_mm / 2.0),
        warn_above=SMALL_SHARE * allowed_mm,
        fail_above=allowed_mm,
    )
    advice: list[str] = []
    if status != "pass" and play_mm / 2.0 > SMALL_SHARE * allowed_mm:
        advice.append(
            f"raise stage.approach_mm above the play of {play_mm:.2f} mm, or take the play out of "
            "spindle and coupling"
        )
    if status != "pass" and loose_mm > SMALL_SHARE * allowed_mm:
        advice.append("tighten board, carriage and coupling; move more slowly")
    return Item(
        "repeatability",
        status,
        f"{read}; the board comes back within {figures.spread_mm:.3f} mm (1 sigma, of which the "
        f"camera's noise is {figures.resolved_mm or 0.0:.3f} mm), from far minus from near "
        f"{figures.play_mm:+.3f} mm; allowed {allowed_mm:.3f} mm",
        "; ".join(advice),
        {
            "read_back_mm": figures.read_back_mm,
            "spread_mm": figures.spread_mm,
            "resolved_mm": figures.resolved_mm,
            "play_mm": figures.play_mm,
            "allowed_mm": allowed_mm,
        },
    )


def judge_reading(sigma_mm: float, wanted_mm: float, profile: Profile) -> Item:
    """Judge distances that a person reads; nobody is sent to one place again and again.

    Args:
        sigma_mm: 1 sigma of one reading.
        wanted_mm: the distance at which the profile's depth error is compared with it.
        profile: says how much error is allowed.
    """
    allowed_mm = profile.quality.holdout_rms_pct / 100.0 * wanted_mm
    status = graded(sigma_mm, warn_above=SMALL_SHARE * allowed_mm, fail_above=allowed_mm)
    return Item(
        "repeatability",
        status,
        f"distances are read within {sigma_mm:.3f} mm (1 sigma, the profile says); allowed "
        f"{allowed_mm:.3f} mm at {wanted_mm:.1f} mm",
        ""
        if status == "pass"
        else "read better and lower the stage's reading_sigma_mm, or raise quality.holdout_rms_pct",
        {"reading_sigma_mm": sigma_mm, "allowed_mm": allowed_mm},
    )
