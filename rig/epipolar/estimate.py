"""The dense slope estimator: from rectified views to slope, sigma and label of every pixel."""

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.aggregate import aggregate, winners
from rig.epipolar.confidence import judge
from rig.epipolar.line import fit_lines
from rig.epipolar.median import guided_median, near_jumps
from rig.epipolar.occlusion import hidden_somewhere
from rig.epipolar.photometry import equalise
from rig.epipolar.scales import Scales, measure_scales
from rig.epipolar.stitch import behind_jumps, stitch
from rig.epipolar.sweep import sweep_costs
from rig.epipolar.views import RectifiedViews, SlopeMap, SlopePrior
from rig.errors import SlopeError

_LABEL_SHIFT_PX = 0.4
"""Distance of neighbouring slope labels, as the shift it makes in the outermost view."""
_STEP_PENALTY, _LOW_PENALTY, _JUMP_PENALTY = 6, 8, 24
_MEDIAN_RADIUS_PX, _MEDIAN_ROUNDS = 4, 2
_STITCH_RADIUS_PX, _STITCH_STRIDE_PX = 5, 1


def estimate_slopes(
    views: RectifiedViews,
    slope_range_px: tuple[float, float],
    prior: SlopePrior | None = None,
) -> SlopeMap:
    """Estimate the slope of the epipolar line through every pixel of the reference view.

    Half-cost plane sweep, semi-global aggregation, guided median at slope edges, one Gauss-Newton
    step per line, locally linear stitching; each module names its source. Every grey scale comes
    from the noise and texture of the images themselves.

    Args:
        views: two or more rectified views.
        slope_range_px: lowest and highest slope to search, px per view step.
        prior: slope hypothesis; where it is finite, only its mean +- 2 sigma is searched.

    Returns:
        Slope, sigma and label of every reference pixel.

    Raises:
        SlopeError: the range is empty, the prior has another shape, an image is not finite, or
            no view but the reference can be used.
    """
    low_px, high_px = _checked_range(slope_range_px)
    bounds = _search_bounds(views.shape, low_px, high_px, prior)
    views, warnings = _usable(views)
    x, y, reference = views.x_steps, views.y_steps, views.reference
    images = equalise(views.images.astype(np.float32), x, y, reference, (low_px, high_px))
    scales = measure_scales(images, reference)
    images = _smooth(images, scales.prefilter_px)
    grey = images[reference]

    labels = slope_labels(low_px, high_px, float(np.hypot(x, y).max()))
    step_px = float(labels[1] - labels[0])
    costs = sweep_costs(images, x, y, reference, labels, scales.truncation)
    total = aggregate(costs, *_jump_penalties(grey, scales), _STEP_PENALTY)
    slope = cast("NDArray[np.float32]", cv2.medianBlur(winners(total, labels, bounds), 3))
    for _ in range(_MEDIAN_ROUNDS):
        slope = guided_median(
            slope,
            grey,
            near_jumps(slope, 1.5 * step_px, _MEDIAN_RADIUS_PX),
            radius_px=_MEDIAN_RADIUS_PX,
            grey_scale=2.0 * scales.likeness,
        )
    slope = _within(slope, bounds)
    lines = fit_lines(images, x, y, reference, slope, scales.doubt, step_px)
    line_sigma_px = scales.smoothed_noise / max(float(np.median(lines.information)), 1e-12) ** 0.5
    stitched, variance, misfit = stitch(
        slope,
        lines.slope_px,
        behind_jumps(slope, lines.information, 2.0 * step_px),
        grey,
        radius_px=_STITCH_RADIUS_PX,
        stride_px=_STITCH_STRIDE_PX,
        slope_gate_px=max(1.5 * step_px, min(6.0 * line_sigma_px, 6.0 * step_px)),
        grey_gate=scales.likeness,
        ridge=0.0,
    )
    slope = _within(stitched, bounds)
    hidden = hidden_somewhere(slope, x, y, 2.0 * step_px)
    return judge(slope, variance, misfit, lines, hidden, scales, high_px - low_px, warnings)


def slope_labels(low_px: float, high_px: float, reach_steps: float) -> NDArray[np.float32]:
    """Evenly spaced slopes from low to high, fine enough for the outermost view, (L,)."""
    count = max(3, int(np.ceil((high_px - low_px) * reach_steps / _LABEL_SHIFT_PX)) + 1)
    return np.linspace(low_px, high_px, count).astype(np.float32)


def _checked_range(slope_range_px: tuple[float, float]) -> tuple[float, float]:
    low_px, high_px = float(slope_range_px[0]), float(slope_range_px[1])
    if not (np.isfinite(low_px) and np.isfinite(high_px) and low_px < high_px):
        raise SlopeError(
            f"asked to search slopes from {low_px:g} to {high_px:g} px per view step; "
            "give two finite numbers, the lower one first"
        )
    return low_px, high_px


def _search_bounds(
    shape: tuple[int, int], low_px: float, high_px: float, prior: SlopePrior | None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lowest and highest slope to search at every pixel, (H, W) each."""
    low = np.full(shape, low_px, np.float32)
    high = np.full(shape, high_px, np.float32)
    if prior is None:
        return low, high
    if prior.slope_px.shape != shape or prior.sigma_px.shape != shape:
        raise SlopeError(
            f"the prior has slopes {prior.slope_px.shape} and sigmas {prior.sigma_px.shape}, the "
            f"views are {shape} (H, W); give a prior of the reference view's shape"
        )
    known = np.isfinite(prior.slope_px) & np.isfinite(prior.sigma_px)
    if np.any(prior.sigma_px[known] < 0):
        raise SlopeError("the prior has a negative sigma; give standard deviations of 0 or more")
    half = 2.0 * prior.sigma_px[known]
    low[known] = prior.slope_px[known] - half
    high[known] = prior.slope_px[known] + half
    return low, high


def _usable(views: RectifiedViews) -> tuple[RectifiedViews, tuple[str, ...]]:
    """Leave out views without any picture in them; say which."""
    if not np.isfinite(views.images).all():
        raise SlopeError("found values that are not finite in the images; give finite grey values")
    spread = views.images[:, ::2, ::2].std(axis=(1, 2))
    dark = spread < 0.02 * float(np.median(spread)) + 1e-12
    dark &= spread < 0.5 * spread[views.reference]
    if not dark.any():
        return views, ()
    kept = np.flatnonzero(~dark)
    if len(kept) < 2:
        raise SlopeError(
            f"only {len(kept)} of {len(dark)} views show anything; look for covered or dead cameras"
        )
    warnings = tuple(
        f"view {i} at ({views.x_steps[i]:g}, {views.y_steps[i]:g}) shows nothing (grey spread "
        f"{spread[i]:.2g}); it was left out"
        for i in np.flatnonzero(dark)
    )
    kept_views = RectifiedViews(
        views.images[kept],
        views.x_steps[kept],
        views.y_steps[kept],
        int(np.searchsorted(kept, views.reference)),
    )
    return kept_views, warnings


def _smooth(images: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    if sigma_px == 0:
        return images
    return np.stack([cv2.GaussianBlur(image, (0, 0), sigma_px) for image in images])


def _jump_penalties(
    grey: NDArray[np.float32], scales: Scales
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Penalty between a pixel and its left neighbour, and between it and the one above."""
    penalties: list[NDArray[np.int16]] = []
    for axis in (1, 0):
        edge = np.abs(np.diff(grey, axis=axis, prepend=grey.take([0], axis=axis)))
        fade = np.exp(-edge / scales.likeness)
        penalties.append((_LOW_PENALTY + (_JUMP_PENALTY - _LOW_PENALTY) * fade).astype(np.int16))
    return penalties[0], penalties[1]


def _within(
    slope_px: NDArray[np.float32], bounds: tuple[NDArray[np.float32], NDArray[np.float32]]
) -> NDArray[np.float32]:
    """Hold the slope inside the searched window: outside it nothing was compared."""
    return np.clip(slope_px, *bounds)
