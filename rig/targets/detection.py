"""What was found of a target in one picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float


@dataclass(frozen=True, slots=True)
class Detection:
    """N points of one target in one picture; a part of the target is enough where ids tell which.

    Point `row * columns + column` of the target is its inner corner in that row and column.
    """

    ids: NDArray[np.intp]
    """(N,) point numbers, growing."""
    xy_px: Float
    """(N, 2)."""
    sigma_px: Float
    """(N,) 1 sigma per coordinate."""
    blur_px: float
    """Median sigma of the edges, pixel area included."""
    contrast: float
    """Median difference of white and black, grey levels of the picture."""

    def __len__(self) -> int:
        return len(self.ids)
