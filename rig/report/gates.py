"""The quality gates of a sweep, one line each, with what to do where one is missed."""

from dataclasses import dataclass

from rig.profile import Profile
from rig.sweep.conclude import SweepResult


@dataclass(frozen=True, slots=True)
class Gate:
    """One limit of the profile and what the sweep reached."""

    name: str
    found_pct: float | None
    """None where it is unknown."""
    allowed_pct: float

    @property
    def passed(self) -> bool:
        """Whether the sweep keeps the limit; what is unknown does not."""
        return self.found_pct is not None and self.found_pct <= self.allowed_pct


def quality_gates(profile: Profile, result: SweepResult) -> tuple[Gate, ...]:
    """Return the limits on depth error, in per cent of distance."""
    holdout, quality = result.fit.holdout, profile.quality
    return (
        Gate(
            "rms depth error at held-out distances",
            None if holdout is None else holdout.rms_pct,
            quality.holdout_rms_pct,
        ),
        Gate(
            "largest depth error at a held-out distance",
            None if holdout is None else holdout.max_pct,
            quality.holdout_max_pct,
        ),
    )
