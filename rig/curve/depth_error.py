"""A depth error at one distance, as it is told."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DepthError:
    """Expanded uncertainty of depth at one distance."""

    distance_mm: float
    expanded_mm: float
    """k = 2: about 95 % of such depths err by less."""

    def __str__(self) -> str:
        digits = ".0f" if self.expanded_mm >= 10 else ".2g"
        return f"+-{self.expanded_mm:{digits}} mm at {self.distance_mm / 1000:.4g} m"
