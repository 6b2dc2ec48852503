"""Which slopes to search, and how finely: the arrangement of the views and a hypothesis."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
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
    steady = prior.steady
    last_px = prior.slope_px if steady is None else steady.slope_px
    has_last = steady is not None and last_px.shape == shape
    slope_px, sigma_px, last_px = (
        np.ascontiguousarray(m, np.float32)
        for m in (prior.slope_px, prior.sigma_px, last_px if has_last else prior.slope_px)
    )
    most_px = np.float32(0.5 * (high_px - low_px))
    ends_px = np.float32(low_px), np.float32(high_px), np.float32(0.5 * (low_px + high_px))

    def work(start: int, stop: int) -> None:
        _open(
            slope_px, sigma_px, last_px, has_last, most_px, *ends_px, start, stop, window.low_px,
            window.high_px, window.expected_px,
        )  # fmt: skip

    run_in_bands(work, shape[0])
    return window


@kernel()
def _open(
    slope: NDArray[np.float32],
    sigma: NDArray[np.float32],
    last: NDArray[np.float32],
    has_last: bool,
    most: np.float32,
    lowest: np.float32,
    highest: np.float32,
    middle: np.float32,
    start: int,
    stop: int,
    low: NDArray[np.float32],
    high: NDArray[np.float32],
    expected: NDArray[np.float32],
) -> None:
    """Fill in some rows of a window around a hypothesis of less than `most` px to either side.

    Where there is none, the last slope (if the frame before has one) or the middle is expected.
    """
    infinite = np.float32(np.inf)
    for v in range(start, stop):
        values, sigmas, before = slope[v], sigma[v], last[v]
        down, up, out = low[v], high[v], expected[v]
        for u in range(len(out)):
            half = np.float32(2) * sigmas[u]
            is_there = abs(values[u]) < infinite
            is_close = is_there & (half < most)
            bottom = values[u] - half if is_close else lowest
            top = values[u] + half if is_close else highest
            raised = max(values[u], bottom)
            kept = min(raised, top)
            down[u], up[u] = bottom, top
            out[u] = kept if is_there else before[u] if has_last else middle
