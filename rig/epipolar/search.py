"""Where each pixel's slope roughly is: an exhaustive, a coarse or a narrow search.

Dense light fields are searched exhaustively at full size. Wide ranges of sparse arrays are searched
at half size, an eighth of the work: the line fit that follows bridges what is left. Where a
hypothesis leaves only a narrow window, only that window is searched, and where it is narrower than
one label, nothing needs to be.
"""

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.aggregate import aggregate, winners
from rig.epipolar.median import guided_median, near_jumps
from rig.epipolar.narrow import narrow_costs
from rig.epipolar.rank import median_of_nine
from rig.epipolar.scales import Scales, measure_scales
from rig.epipolar.sweep import sweep_costs
from rig.epipolar.views import SlopePrior
from rig.errors import SlopeError

LABEL_SHIFT_PX = 0.4
"""Distance of neighbouring slope labels, as the shift it makes in the outermost view."""
_COARSE_FROM_LABELS = 96
_NARROW_UP_TO_LABELS = 8
_FEW = 0.05
"""Share of pixels without a narrow window up to which a quarter-size search is enough."""
_STEP_PENALTY, _LOW_PENALTY, _JUMP_PENALTY = 6, 8, 24
_COARSE_MEDIAN_RADIUS_PX = 3


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

    @property
    def middle_px(self) -> NDArray[np.float32]:
        """(H, W), what is expected if the window is narrow."""
        return np.float32(0.5) * (self.low_px + self.high_px)

    def shrunk(self, shrink: int) -> "Window":
        """Return the window of images that are `shrink` times smaller."""
        size = (self.low_px.shape[1] // shrink, self.low_px.shape[0] // shrink)
        low, high = (
            cast("NDArray[np.float32]", cv2.resize(bound, size, interpolation=cv2.INTER_NEAREST))
            for bound in (self.low_px, self.high_px)
        )
        return Window(low / np.float32(shrink), high / np.float32(shrink))

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
    if prior is None:
        return Window(low, high)
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
    return Window(low, high)


def search(
    images: NDArray[np.float32], cameras: Cameras, window: Window, scales: Scales
) -> NDArray[np.float32]:
    """Slope of every pixel to within about a label, (H, W), inside its window."""
    wide = window.high_px - window.low_px > _NARROW_UP_TO_LABELS * cameras.step_px
    if not wide.any():
        if window.widest_px() <= cameras.step_px:
            return window.middle_px
        return _search_narrow(images, cameras, window, scales)
    labels = _labels(float(window.low_px.min()), float(window.high_px.max()), cameras.step_px)
    if wide.mean() < _FEW:
        return np.where(wide, _search_coarse(images, cameras, window, 4), window.middle_px)
    if len(labels) <= _COARSE_FROM_LABELS:
        return _search_all(images, cameras, window, scales, labels)
    return np.where(wide, _search_coarse(images, cameras, window, 2), window.middle_px)


def _labels(low_px: float, high_px: float, step_px: float) -> NDArray[np.float32]:
    count = max(3, int(np.ceil((high_px - low_px) / step_px)) + 1)
    return np.linspace(low_px, high_px, count).astype(np.float32)


def _search_all(
    images: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
    labels: NDArray[np.float32],
) -> NDArray[np.float32]:
    costs = sweep_costs(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, labels, scales.truncation
    )
    penalties = _jump_penalties(images[cameras.reference], scales)
    slope = winners(
        aggregate(costs, *penalties, _STEP_PENALTY), labels, window.low_px, window.high_px
    )
    return window.hold(median_of_nine(slope))


def _search_narrow(
    images: NDArray[np.float32], cameras: Cameras, window: Window, scales: Scales
) -> NDArray[np.float32]:
    middle = window.middle_px
    reach = int(np.ceil(0.5 * window.widest_px() / cameras.step_px))
    offsets = np.float32(cameras.step_px) * np.arange(-reach, reach + 1, dtype=np.float32)
    costs = narrow_costs(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, middle, offsets,
        scales.truncation,
    )  # fmt: skip
    penalties = _jump_penalties(images[cameras.reference], scales)
    total = aggregate(costs, *penalties, _STEP_PENALTY)
    offset = winners(total, offsets, window.low_px - middle, window.high_px - middle)
    return window.hold(median_of_nine(middle + offset))


def _search_coarse(
    images: NDArray[np.float32], cameras: Cameras, window: Window, shrink: int
) -> NDArray[np.float32]:
    """Exhaustive search of smaller images; slopes shrink with the pixels."""
    height, width = images.shape[1:]
    size = (width // shrink, height // shrink)
    small = np.stack([cv2.resize(i, size, interpolation=cv2.INTER_AREA) for i in images])
    small_window = window.shrunk(shrink)
    scales = measure_scales(small, cameras.reference)
    low_px, high_px = float(small_window.low_px.min()), float(small_window.high_px.max())
    labels = _labels(low_px, high_px, cameras.step_px)
    slope = _search_all(small, cameras, small_window, scales, labels)
    slope = guided_median(
        slope,
        small[cameras.reference],
        near_jumps(slope, 1.5 * cameras.step_px, _COARSE_MEDIAN_RADIUS_PX),
        radius_px=_COARSE_MEDIAN_RADIUS_PX,
        grey_scale=2.0 * scales.likeness,
    )
    slope = cv2.resize(slope, (width, height), interpolation=cv2.INTER_NEAREST)
    return window.hold(np.float32(shrink) * cast("NDArray[np.float32]", slope))


def _jump_penalties(
    grey: NDArray[np.float32], scales: Scales
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Penalty between a pixel and its left neighbour, and between it and the one above."""
    penalties: list[NDArray[np.int16]] = []
    for axis in (1, 0):
        edge = np.abs(np.diff(grey, axis=axis, prepend=grey.take([0], axis=axis)))
        fade = np.exp(-edge / np.float32(scales.likeness))
        penalties.append((_LOW_PENALTY + (_JUMP_PENALTY - _LOW_PENALTY) * fade).astype(np.int16))
    return penalties[0], penalties[1]
