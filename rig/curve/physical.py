"""The physical law of triangulation, bare and with one curvature term."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rig.curve.law import Floats, Law, ModelName

NEWTON_STEPS = 10
"""The correction is small and monotone: four reach the last digit."""


@dataclass(frozen=True)
class Physical(Law):
    """`Z = z0 + a / (m - m_inf)`: pinhole views on a line, rectified to a common focus.

    Triangulation (Szeliski, Computer Vision, 2nd ed., 2022, equation 12.1) gives a slope of focal
    length times pitch over distance, less a constant that the focus distance sets.
    """

    name: ClassVar[ModelName] = "physical"

    z0_mm: float
    """Where the rays meet, in the distances of the sweep."""
    a_px_mm: float
    """Focal length times pitch."""
    m_inf_px: float
    """Slope of a point at infinity; 0 for parallel cameras that are not refocused."""

    @property
    def fitted(self) -> tuple[str, ...]:
        """See `Law.fitted`."""
        return "z0_mm", "a_px_mm", "m_inf_px"

    def depth_mm(self, slope_px: Floats) -> Floats:
        """See `Law.depth_mm`."""
        return self.z0_mm + self.a_px_mm / (slope_px - self.m_inf_px)

    def slope_px(self, distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Law.slope_px`."""
        return self.m_inf_px + self.a_px_mm / (distance_mm - self.z0_mm)

    def depth_per_slope(self, slope_px: Floats) -> Floats:
        """See `Law.depth_per_slope`."""
        return -self.a_px_mm / (slope_px - self.m_inf_px) ** 2

    def slope_gradient(self, slope_px: Floats) -> Floats:
        """See `Law.slope_gradient`."""
        parallax_px = slope_px - self.m_inf_px
        columns = (
            parallax_px**2 / self.a_px_mm,
            parallax_px / self.a_px_mm,
            np.ones_like(slope_px),
        )
        return np.stack(columns, axis=-1)


@dataclass(frozen=True)
class PhysicalCurved(Law):
    """The physical law of the slope `m + curvature_px * T3(t)`, t from -1 (far) to 1 (near).

    In the inverse distance u the physical law already takes up a constant (m_inf), u (a) and u^2 (a
    shift of z0), so the first shape that is new to it is cubic. That is also what radial distortion
    leaves of a board off the axis: its image radius goes with u, its disparity error with u^3. The
    Chebyshev polynomial T3 = 4 t^3 - 3 t makes the parameter the largest correction in px, and
    correcting the slope, not the distance, keeps the way to depth in closed form.
    """

    name: ClassVar[ModelName] = "physical-curved"

    z0_mm: float
    a_px_mm: float
    m_inf_px: float
    curvature_px: float
    """Largest correction of the slope between `low_px` and `high_px`."""
    low_px: float
    """Slope of the farthest stop, where t = -1; given, not fitted."""
    high_px: float
    """Slope of the nearest stop, where t = 1; given, not fitted."""

    @property
    def fitted(self) -> tuple[str, ...]:
        """See `Law.fitted`."""
        return (*self.physical.fitted, "curvature_px")

    @property
    def physical(self) -> Physical:
        """The law that holds for corrected slopes."""
        return Physical(self.z0_mm, self.a_px_mm, self.m_inf_px)

    def corrected_px(self, slope_px: Floats) -> Floats:
        """The slope that the physical law would have shown."""
        t = self._t(slope_px)
        return slope_px + self.curvature_px * t * (4 * t * t - 3)

    def correction_rate(self, slope_px: Floats) -> Floats:
        """Derivative of `corrected_px`; the law is monotone where this is positive."""
        t = self._t(slope_px)
        return 1 + self.curvature_px * (12 * t * t - 3) * (2 / (self.high_px - self.low_px))

    def depth_mm(self, slope_px: Floats) -> Floats:
        """See `Law.depth_mm`."""
        return self.physical.depth_mm(self.corrected_px(slope_px))

    def slope_px(self, distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Law.slope_px`; NaN where Newton's iteration finds no slope."""
        target_px = self.physical.slope_px(distance_mm)
        slope_px = target_px
        for _ in range(NEWTON_STEPS):
            miss_px = self.corrected_px(slope_px) - target_px
            slope_px = slope_px - miss_px / self.correction_rate(slope_px)
        miss_px = self.corrected_px(slope_px) - target_px
        return np.where(np.abs(miss_px) < 1e-10 * (self.high_px - self.low_px), slope_px, np.nan)

    def depth_per_slope(self, slope_px: Floats) -> Floats:
        """See `Law.depth_per_slope`."""
        at_px = self.corrected_px(slope_px)
        return self.physical.depth_per_slope(at_px) * self.correction_rate(slope_px)

    def slope_gradient(self, slope_px: Floats) -> Floats:
        """See `Law.slope_gradient`."""
        t = self._t(slope_px)
        outer = self.physical.slope_gradient(self.corrected_px(slope_px))
        inner = -t * (4 * t * t - 3)
        return np.column_stack((outer, inner)) / self.correction_rate(slope_px)[:, None]

    def _t(self, slope_px: Floats) -> Floats:
        return (2 * slope_px - (self.low_px + self.high_px)) / (self.high_px - self.low_px)
