"""Which slopes to search, and how finely: the arrangement of the views and a hypothesis."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
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
        height, width = (side // shrink for side in self.low_px.shape)
        first = shrink // 2
        maps = (
            m[first::shrink, first::shrink][:height, :width]
            for m in (self.low_px, self.high_px, self.expected_px)
        )
        return Window(*(m / np.float32(shrink) for m in maps))

    def widest_px(self) -> float:
        """Width of the widest window, px per view step."""
        return float((self.high_px - self.low_px).max())

    def labels(self, step_px: float) -> NDArray[np.float32]:
        """Evenly spaced slopes (L,) from the lowest to the highest, at most a step apart."""
        low_px, high_px = float(self.low_px.min()), float(self.high_px.max())
        count = max(3, int(np.ceil((high_px - low_px) / step_px)) + 1)
        return np.linspace(low_px, high_px, count).astype(np.float32)

    def hold(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Hold slopes (H, W) inside the window: outside it nothing was compared."""
        held = np.empty_like(slope_px)

        def work(start: int, stop: int) -> None:
            r = slice(start, stop)
            np.maximum(slope_px[r], self.low_px[r], out=held[r])
            np.minimum(held[r], self.high_px[r], out=held[r])

        run_in_bands(work, len(held))
        return held

    def is_wider(self, than_px: float) -> NDArray[np.bool_]:
        """Pixels whose window is wider than this, (H, W)."""
        wider = np.empty(self.low_px.shape, np.bool_)

        def work(start: int, stop: int) -> None:
            r = slice(start, stop)
            np.greater(self.high_px[r] - self.low_px[r], np.float32(than_px), out=wider[r])

        run_in_bands(work, len(wider))
        return wider


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
            f"asked to search slopes from {low_px:g} to {high_px:g} px per view step",
            advice="give two finite numbers, the lower one first",
        )
    if prior is None:
        middle_px = 0.5 * (low_px + high_px)
        return Window(*(np.full(shape, end, np.float32) for end in (low_px, high_px, middle_px)))
    if prior.slope_px.shape != shape or prior.sigma_px.shape != shape:
        raise SlopeError(
            f"the prior has slopes {prior.slope_px.shape} and sigmas {prior.sigma_px.shape}, the "
            f"views are {shape} (H, W)",
            advice="give a prior of the reference view's shape",
        )
    if np.any(prior.sigma_px < 0):
        raise SlopeError(
            "the prior has a negative sigma", advice="give standard deviations of 0 or more"
        )
    window = Window(*(np.empty(shape, np.float32) for _ in range(3)))
    run_in_bands(lambda a, b: _open(window, slice(a, b), prior, low_px, high_px), shape[0])
    return window


def _open(window: Window, rows: slice, prior: SlopePrior, low_px: float, high_px: float) -> None:
    """Fill some rows of a window around a hypothesis."""
    slope, half = prior.slope_px[rows], np.float32(2) * prior.sigma_px[rows]
    low, high, expected = window.low_px[rows], window.high_px[rows], window.expected_px[rows]
    there = np.isfinite(slope)
    wide = ~(there & (half < 0.5 * (high_px - low_px)))
    np.subtract(slope, half, out=low)
    np.add(slope, half, out=high)
    low[wide], high[wide] = low_px, high_px
    np.minimum(np.maximum(slope, low), high, out=expected)
    expected[~there] = 0.5 * (low_px + high_px)
    if prior.steady is not None and prior.steady.slope_px.shape == prior.slope_px.shape:
        np.copyto(expected, prior.steady.slope_px[rows], where=~there)
