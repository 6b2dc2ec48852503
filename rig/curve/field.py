"""The field term of a depth-slope curve: what the slope of one depth changes over the picture.

Cameras that are turned against their calibration by little shift the slope by an amount that is
linear in the pixel and the same at every depth.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from rig.errors import CurveError


@dataclass(frozen=True)
class FieldTerm:
    """Slope added to that of the curve: `per_px @ (pixel - at_px)`.

    Raises:
        CurveError: a number is not finite, or the covariance is none.
    """

    at_px: tuple[float, float]
    """Pixel of the reference view where the term is 0."""
    per_px: tuple[float, float]
    """px per view step, per px right and down."""
    covariance: tuple[tuple[float, float], tuple[float, float]]
    """Of `per_px`."""

    def __post_init__(self) -> None:
        numbers = (*self.at_px, *self.per_px, *self.covariance[0], *self.covariance[1])
        if not all(map(isfinite, numbers)) or np.linalg.eigvalsh(self.covariance)[0] < 0:
            raise CurveError(
                f"a field term of {self.per_px} per px with covariance {self.covariance} cannot "
                "be used",
                advice="fit the sweep again",
            )

    def slope_px(self, x_px: float, y_px: float) -> float:
        """Slope that the term adds at a pixel."""
        return self.per_px[0] * (x_px - self.at_px[0]) + self.per_px[1] * (y_px - self.at_px[1])

    def maps(self, shape: tuple[int, int]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Slope that the term adds, and the variance of that, at every pixel: (H, W) each."""
        return _maps(self, shape)


@lru_cache(maxsize=4)
def _maps(
    term: FieldTerm, shape: tuple[int, int]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    rows, columns = np.indices(shape, dtype=np.float64)
    x, y = columns - term.at_px[0], rows - term.at_px[1]
    (xx, xy), (_, yy) = term.covariance
    slope = term.per_px[0] * x + term.per_px[1] * y
    variance = xx * x * x + 2.0 * xy * x * y + yy * y * y
    return slope.astype(np.float32), np.maximum(variance, 0.0).astype(np.float32)
