"""Which slopes to search, and how finely: the arrangement of the views and a hypothesis."""

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.views import SlopePrior
from rig.errors import SlopeError

LABEL_SHIFT_PX = 0.4
"""Distance of neighbouring slope labels, as the shift it makes in the outermost view."""


@dataclass(frozen=True, slots=True)
class Cameras:
    """Where the views stand."""

    x_steps: NDArray[np.float64]
    """(V,) view columns, view steps."""
    y_steps: NDArray[np.float64]
    """(V,) view rows, view steps."""
    reference: int
    """Index of the view at (0, 0)."""

    @property
    def step_px(self) -> float:
        """Distance of neighbouring labels, px per view step."""
        return LABEL_SHIFT_PX / float(np.hypot(self.x_steps, self.y_steps).max())


@dataclass(frozen=True, slots=True)
class Window:
    """The slopes to search at every pixel."""

    low_px: NDArray[np.float32]
    """(H, W), px per view step."""
    high_px: NDArray[np.float32]
    """(H, W), px per view step."""
    expected_px: NDArray[np.float32]
    """(H, W), the hypothesis, however uncertain; the middle of the window where there is none."""

    def shrunk(self, shrink: int) -> "Window":
        """Return the window of images that are `shrink` times smaller."""
        size = (self.low_px.shape[1] // shrink, self.low_px.shape[0] // shrink)
        maps = (
            cast("NDArray[np.float32]", cv2.resize(m, size, interpolation=cv2.INTER_NEAREST))
            for m in (self.low_px, self.high_px, self.expected_px)
        )
        return Window(*(m / np.float32(shrink) for m in maps))

    def widest_px(self) -> float:
        """Width of the widest window, px per view step."""
        return float((self.high_px - self.low_px).max())

    def hold(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Hold slopes (H, W) inside the window: outside it nothing was compared."""
        return np.clip(slope_px, self.low_px, self.high_px)


def window_of(
    shape: tuple[int, int], slope_range_px: tuple[float, float], prior: SlopePrior | None
) -> Window:
    """Return the prior's mean +- 2 sigma where there is one, the whole range elsewhere.

    A hypothesis whose window would be as wide as the range says nothing, and counts as none.

    Raises:
        SlopeError: the range is empty, or the prior has another shape or a negative sigma.
    """
    low_px, high_px = float(slope_range_px[0]), float(slope_range_px[1])
    if not (np.isfinite(low_px) and np.isfinite(high_px) and low_px < high_px):
        raise SlopeError(
            f"asked to search slopes from {low_px:g} to {high_px:g} px per view step; "
            "give two finite numbers, the lower one first"
        )
    low, high = np.full(shape, low_px, np.float32), np.full(shape, high_px, np.float32)
    expected = np.full(shape, 0.5 * (low_px + high_px), np.float32)
    if prior is None:
        return Window(low, high, expected)
    if prior.slope_px.shape != shape or prior.sigma_px.shape != shape:
        raise SlopeError(
            f"the prior has slopes {prior.slope_px.shape} and sigmas {prior.sigma_px.shape}, the "
            f"views are {shape} (H, W); give a prior of the reference view's shape"
        )
    half = np.float32(2) * prior.sigma_px
    if np.any(half < 0):
        raise SlopeError("the prior has a negative sigma; give standard deviations of 0 or more")
    known = np.isfinite(prior.slope_px) & (half < 0.5 * (high_px - low_px))
    np.copyto(low, prior.slope_px - half, where=known)
    np.copyto(high, prior.slope_px + half, where=known)
    np.clip(prior.slope_px, low, high, out=expected, where=np.isfinite(prior.slope_px))
    return Window(low, high, expected)
