"""What a sweep hands to the fit: one point per stop."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.errors import CurveError

SAME_DISTANCE_MM = 0.1
"""Stops closer than this are visits of one distance: read-back differs by micrometres."""
PRIOR_SAMPLES = 4.0
"""Weight of the sweep's pooled scatter beside a stop's own, in samples."""


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """The slope of the board, averaged over the samples of one stop.

    Raises:
        CurveError: a number is not finite or not possible.
    """

    distance_mm: float
    """From the reference camera's optical centre to the board along +z."""
    slope_px: float
    """Mean over the samples, px per view step; nearer is larger."""
    std_px: float
    """Standard deviation of one sample."""
    sem_px: float
    """Standard error of `slope_px`."""
    samples: int
    role: Literal["fit", "holdout"]
    """Held-out stops judge the curve; they enter neither the fit nor the choice of the model."""
    direction: Literal["forward", "backward"]

    def __post_init__(self) -> None:
        if not (math.isfinite(self.distance_mm) and self.distance_mm > 0):
            raise CurveError(
                f"a stop at {self.distance_mm} mm cannot be used",
                advice="distances are counted from the "
                "reference camera's optical centre and must be above 0 mm",
            )
        scatter = (self.std_px, self.sem_px)
        if not math.isfinite(self.slope_px) or not all(
            math.isfinite(s) and s >= 0 for s in scatter
        ):
            raise CurveError(
                f"{self.name} has slope {self.slope_px} px, std {self.std_px} px, sem "
                f"{self.sem_px} px",
                advice="these must be finite and scatter not negative: repeat the stop",
            )
        if self.samples < 1:
            raise CurveError(
                f"{self.name} has {self.samples} samples", advice="a stop needs at least 1"
            )

    @property
    def name(self) -> str:
        """How messages call this stop."""
        return f"the stop at {self.distance_mm:.3f} mm ({self.direction})"


@dataclass(frozen=True, slots=True)
class Stops:
    """The numbers of S stops as arrays, ordered by distance."""

    distance_mm: NDArray[np.float64]
    """(S,) rising."""
    slope_px: NDArray[np.float64]
    """(S,)"""
    variance_px2: NDArray[np.float64]
    """(S,) variance of `slope_px` as far as the samples of the stop show it, never 0."""
    group: NDArray[np.intp]
    """(S,) index of the distance that the stop visited, 0 is the nearest."""

    @property
    def distances(self) -> int:
        """How many different distances there are."""
        return int(self.group[-1]) + 1

    def keep(self, mask: NDArray[np.bool_]) -> "Stops":
        """Return the stops where `mask` (S,) is true, distances counted anew."""
        _, group = np.unique(self.group[mask], return_inverse=True)
        return Stops(
            self.distance_mm[mask],
            self.slope_px[mask],
            self.variance_px2[mask],
            group.astype(np.intp),
        )


def same_distance(distance_mm: NDArray[np.float64]) -> NDArray[np.intp]:
    """Number the distinct distances of a rising array: (S,) -> (S,)."""
    return np.cumsum(np.diff(distance_mm, prepend=distance_mm[0]) > SAME_DISTANCE_MM).astype(
        np.intp
    )


def stops_of(points: Sequence[CurvePoint]) -> Stops:
    """Collect points, which must be ordered by distance, into arrays.

    A standard error from few samples is itself uncertain, and one that is small by chance would
    pull the whole curve. Each is therefore moderated by the pooled one, which counts as
    `PRIOR_SAMPLES` samples (the empirical-Bayes form of Smyth, Stat. Appl. Genet. Mol. Biol. 3,
    2004). A floor of 1e-12 of the slopes' span keeps the weights of noiseless slopes finite.
    """
    distance_mm = np.array([p.distance_mm for p in points])
    slope_px = np.array([p.slope_px for p in points])
    sem2_px2 = np.array([p.sem_px for p in points]) ** 2
    freedom = np.array([p.samples - 1.0 for p in points])
    pooled_px2 = float(freedom @ sem2_px2 / max(float(freedom.sum()), 1.0))
    variance_px2 = (PRIOR_SAMPLES * pooled_px2 + freedom * sem2_px2) / (PRIOR_SAMPLES + freedom)
    floor_px2 = (1e-12 * max(float(np.ptp(slope_px)), 1e-12)) ** 2
    return Stops(distance_mm, slope_px, variance_px2 + floor_px2, same_distance(distance_mm))
