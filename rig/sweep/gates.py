"""The quality gates of a sweep: limits of the profile beside what was reached."""

from dataclasses import dataclass

from rig.curve import HoldoutError
from rig.profile import Profile


@dataclass(frozen=True, slots=True)
class Gate:
    """One limit of the profile and what the sweep reached, in per cent of distance."""

    name: str
    found_pct: float | None
    """None where it is unknown."""
    allowed_pct: float

    @property
    def passed(self) -> bool:
        """Whether the sweep keeps the limit; what is unknown does not."""
        return self.found_pct is not None and self.found_pct <= self.allowed_pct

    def __str__(self) -> str:
        found = (
            "unknown: none was held out" if self.found_pct is None else f"{self.found_pct:.4f} %"
        )
        return f"{self.name} is {found}, allowed {self.allowed_pct:.4f} %"


def quality_gates(profile: Profile, holdout: HoldoutError | None) -> tuple[Gate, ...]:
    """Return the limits on depth error at distances that the fit has not seen."""
    quality = profile.quality
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
