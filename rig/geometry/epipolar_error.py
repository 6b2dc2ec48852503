"""How far points lie from the epipolar lines of their partners, in three numbers."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float, Number


@dataclass(frozen=True, slots=True)
class EpipolarError:
    """Distance of points from the epipolar line of their partner; NaN where there are none."""

    mean_px: Number
    p95_px: Number
    """95th percentile."""
    max_px: Number

    @classmethod
    def of(cls, distance_px: Float) -> "EpipolarError":
        """Summarise distances (N,), none of them NaN."""
        if not distance_px.size:
            return cls(float("nan"), float("nan"), float("nan"))
        mean_px, p95_px = float(distance_px.mean()), float(np.percentile(distance_px, 95))
        return cls(mean_px, p95_px, float(distance_px.max()))
