"""Two straight lines that meet at the focus distance."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rig.curve.law import Floats, Law, ModelName


@dataclass(frozen=True)
class TwoLines(Law):
    """`m = rate * (Z - focus)` with one rate before and one after the focus distance.

    The law as calibrations by hand report it: slope linear in distance, separately on either side
    of the focus distance. It is the tangent of the physical law, so it holds near the focus only.
    """

    name: ClassVar[ModelName] = "two-lines"

    focus_mm: float
    before_px_per_mm: float
    """Negative: the slope falls as the board goes away."""
    after_px_per_mm: float
    """Negative."""

    @property
    def fitted(self) -> tuple[str, ...]:
        """See `Law.fitted`."""
        return "focus_mm", "before_px_per_mm", "after_px_per_mm"

    def depth_mm(self, slope_px: Floats) -> Floats:
        """See `Law.depth_mm`."""
        return self.focus_mm + slope_px * self.depth_per_slope(slope_px)

    def slope_px(self, distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Law.slope_px`."""
        away_mm = distance_mm - self.focus_mm
        return away_mm * np.where(away_mm < 0, self.before_px_per_mm, self.after_px_per_mm)

    def depth_per_slope(self, slope_px: Floats) -> Floats:
        """See `Law.depth_per_slope`; at the focus itself the side after it."""
        before, after = 1 / self.before_px_per_mm, 1 / self.after_px_per_mm
        return np.where(slope_px > 0, slope_px.dtype.type(before), slope_px.dtype.type(after))

    def slope_gradient(self, slope_px: Floats) -> Floats:
        """See `Law.slope_gradient`."""
        before = slope_px > 0
        away_mm = slope_px * self.depth_per_slope(slope_px)
        columns = (
            -1 / self.depth_per_slope(slope_px),
            np.where(before, away_mm, 0.0),
            np.where(before, 0.0, away_mm),
        )
        return np.stack(columns, axis=-1)
