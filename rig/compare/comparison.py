"""The whole comparison as a value, and every method over all distances."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.compare.curves import CurvesAt
from rig.compare.distances import NAMES, BoardErrors
from rig.compare.frames import FrameComparison
from rig.profile import Profile

PAGE_FILE, NUMBERS_FILE = "compare.html", "compare.json"


@dataclass(frozen=True, slots=True)
class DistanceScore:
    """One method over all distances."""

    method: str
    bias_mm: float
    """Root mean square of the mean errors at each distance."""
    bias_pct: float
    """The same as a part of the distance."""
    worst_pct: float
    """Largest of these parts."""
    spread_mm: float
    """Median over the distances of the standard deviation over the board."""
    density_pct: float
    """Mean part of the board with an answer."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """All methods on the same frames, and on the board of a sweep where there is a curve."""

    profile: Profile
    curve_id: int | None
    """Number of the curve; None for slopes only, and for the curve of a calibration alone."""
    curve_title: str | None
    """What the curve is called; None for slopes only."""
    sweep_id: int | None
    frames: FrameComparison
    distances: tuple[BoardErrors, ...]
    """From near to far; empty without a curve."""
    curves: tuple[CurvesAt, ...]
    """The curve beside that of the calibration alone, where the sweep has one."""
    folder: Path
    origin: str | None = None
    """What must be said of the calibration; None for nothing."""

    @property
    def unit(self) -> str:
        """Unit of the maps."""
        return "px per view step" if self.curve_title is None else "mm"


def distance_scores(boards: Sequence[BoardErrors]) -> tuple[DistanceScore, ...]:
    """Sum up every method over the distances where it has an answer; nothing without any."""
    if not boards:
        return ()
    distance_mm = np.array([board.distance_mm for board in boards])
    scores: list[DistanceScore] = []
    for name in NAMES:
        errors = [board.errors[name] for board in boards]
        mean_mm = np.array([error.mean_mm for error in errors])
        known = np.isfinite(mean_mm)
        mean_pct = 100.0 * mean_mm[known] / distance_mm[known]
        spread_mm = np.array([error.spread_mm for error in errors])[known]
        scores.append(
            DistanceScore(
                method=name,
                bias_mm=_rms(mean_mm[known]),
                bias_pct=_rms(mean_pct),
                worst_pct=float(np.abs(mean_pct).max(initial=0.0)) if known.any() else np.nan,
                spread_mm=float(np.median(spread_mm)) if known.any() else np.nan,
                density_pct=float(np.mean([error.density_pct for error in errors])),
            )
        )
    return tuple(scores)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
