"""What a search of slopes gives."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found."""

    slope_px: NDArray[np.float32]
    """(H, W) to within about a label, px per view step."""
    rival_px: NDArray[np.float32]
    """(H, W) the best slope that is not beside it; NaN where none was looked at."""
    unshared: NDArray[np.bool_]
    """(H, W) slopes that the outermost view does not confirm, where all views lie on one side."""
    apart_px: NDArray[np.float32]
    """(H, W) by how much it differs, or what took its place does; 0 where it confirms them."""

    @classmethod
    def alone(cls, slope_px: NDArray[np.float32]) -> "Found":
        """Return slopes without rivals: their surroundings were known."""
        return cls.of_all(slope_px, np.full_like(slope_px, np.nan))

    @classmethod
    def of_all(cls, slope_px: NDArray[np.float32], rival_px: NDArray[np.float32]) -> "Found":
        """Return slopes that nothing contradicts."""
        nowhere = np.zeros(slope_px.shape, np.bool_)
        return cls(slope_px, rival_px, nowhere, np.zeros_like(slope_px))

    def only(self, wide: NDArray[np.bool_], expected_px: NDArray[np.float32]) -> "Found":
        """Return what was found where it was looked for, what was expected elsewhere, (H, W)."""
        return Found(
            np.where(wide, self.slope_px, expected_px),
            np.where(wide, self.rival_px, np.float32(np.nan)),
            self.unshared & wide,
            np.where(wide, self.apart_px, np.float32(0)),
        )
