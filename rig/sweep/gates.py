"""The quality gates of a sweep: limits of the profile beside what was reached."""

from collections.abc import Sequence
from dataclasses import dataclass

from rig.curve import HoldoutError
from rig.profile import Profile
from rig.sweep.points import StopResult


@dataclass(frozen=True, slots=True)
class Gate:
    """One limit of the profile and what the sweep reached."""

    name: str
    value: float | None
    """None where it is unknown."""
    allowed: float
    unit: str

    @property
    def passed(self) -> bool:
        """Whether the sweep keeps the limit; what is unknown does not."""
        return self.value is not None and self.value <= self.allowed

    def __str__(self) -> str:
        allowed = f"allowed {self.allowed:.4g} {self.unit}"
        if self.value is None:
            return f"{self.name} is unknown; {allowed}"
        return f"{self.name} is {self.value:.4g} {self.unit}, {allowed}"


def quality_gates(
    profile: Profile, holdout: HoldoutError | None, stops: Sequence[StopResult]
) -> tuple[Gate, ...]:
    """Return the limits: depth error at distances that the fit has not seen, and rectification.

    The curve is measured at the board's centre. Views that are not rectified can have a perfect
    curve and still give wrong depth elsewhere, which the curve's own error does not show.
    """
    quality = profile.quality
    beside_px = [stop.track_residual_px for stop in stops if stop.track_residual_px is not None]
    return (
        Gate(
            "rms depth error at held-out distances",
            None if holdout is None else holdout.rms_pct,
            quality.holdout_rms_pct,
            "%",
        ),
        Gate(
            "largest depth error at a held-out distance",
            None if holdout is None else holdout.max_pct,
            quality.holdout_max_pct,
            "%",
        ),
        Gate(
            "rms distance of corners from their epipolar lines",
            max(beside_px, default=None),
            quality.line_rms_px,
            "px",
        ),
    )
