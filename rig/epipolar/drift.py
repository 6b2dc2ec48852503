"""Light that changes with the view: gloss, and everything else that no match explains.

The grey value of a point of a glossy surface is not the same for all views. Over the few degrees of
an array it grows or falls in proportion to the view's distance, much the same for neighbouring
points (the highlight of a rough surface is broad), and looks like a slope wherever texture is weak.
It is found from the first match, taken out of the search, and measured once more at the slopes that
the search then finds.

The drift is kept as an array (2, H, W): by how much the grey value of each reference pixel grows
per view step along the row and along the column.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.drift_fit import fit_drift
from rig.epipolar.mending.first_match import FirstMatch
from rig.epipolar.rank import mean
from rig.epipolar.sampling import pad
from rig.epipolar.scales import Scales, measure_scales
from rig.epipolar.search.search import search
from rig.epipolar.search.shrink import shrink
from rig.epipolar.search.window import Cameras, Window

_FEWEST_VIEWS = 3
_COARSE_RADIUS_PX = 5
"""Of the small images."""
_STRIDE_PX, _RADIUS = 3, 4
_GATE_LABELS = 6.0
_DOUBT = 2.0
"""Cauchy scale, in that of the line fit: grey values differ by the drift that is still unknown."""
_SLOPE_ERROR_LABELS = 1.0
_JOINED_RADIUS_PX = 3
"""Neighbours that share a slope: half the window of `stitch`, in which like ones count most, and
over which a drift is not quite the same."""


def coarse_drift(
    images: NDArray[np.float32], cameras: Cameras, window: Window, first: FirstMatch
) -> NDArray[np.float32] | None:
    """Tell the drift (2, H, W) before the search, from images of the size of the first match.

    What drifts is searched once more without its drift: more slopes are right, and tell more.

    Args:
        images: (V, H, W) equalised grey values.
        cameras: where the views stand.
        window: the slopes to search.
        first: a match that hardly sees light.

    Returns:
        None where nothing drifts more than chance would have it, and of a pair: what drifts there
        is one slope more.
    """
    if len(images) < _FEWEST_VIEWS:
        return None
    small = shrink(images, first.factor)
    scales = measure_scales(small, cameras.reference)
    splines = pad(small, cameras.x_steps, cameras.y_steps)
    told = _fit(small, splines, first.slope_px, None, cameras, scales, 1, _COARSE_RADIUS_PX)
    if told is not None and not first.is_told:
        drift, narrow = told[0], window.shrunk(first.factor)
        slope_px = search(small, cameras, narrow, scales, splines, drift).slope_px
        told = _fit(small, splines, slope_px, drift, cameras, scales, 1, _COARSE_RADIUS_PX)
    return None if told is None else _spread(told[0], first.factor, images.shape[1:])


def local_drift(
    images: NDArray[np.float32],
    splines: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    before: NDArray[np.float32],
    cameras: Cameras,
    scales: Scales,
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """Tell a drift closer where the slopes are known, or None as in `coarse_drift`.

    Args:
        images: (V, H, W) equalised grey values.
        splines: what `rig.epipolar.sampling.pad` makes of them.
        slope_px: (H, W) slopes, px per view step.
        before: (2, H, W) the drift as it is known so far.
        cameras: where the views stand.
        scales: grey scales of the images.

    Returns:
        Drift and its variance, (2, H, W) each.
    """
    told = _fit(images, splines, slope_px, before, cameras, scales, _STRIDE_PX, _RADIUS)
    if told is None:
        return None
    # What windows take from a drift that bends is about what they would take from it once more.
    for drift, variance in zip(*told, strict=True):
        lost = drift - mean(drift, _RADIUS)
        variance += mean(lost * lost, _RADIUS)
    drift, variance = (_spread(part, _STRIDE_PX, slope_px.shape) for part in told)
    return drift, variance


def variance_of_slopes(
    variance: NDArray[np.float32], grey: NDArray[np.float32], cameras: Cameras
) -> NDArray[np.float32]:
    """Variance that an uncertain drift gives the slopes that neighbours share, (H, W).

    What is unknown of the drift is common to all of them, and passes through the normal equations
    of their lines: where grey slopes of both signs meet, it cancels.

    Args:
        variance: (2, H, W) of the drift.
        grey: (H, W) reference view.
        cameras: where the views stand.
    """
    spread = np.cov(cameras.x_steps, cameras.y_steps, bias=True).astype(np.float32)
    steep = [cv2.Sobel(grey, cv2.CV_32F, axis, 1 - axis, ksize=1, scale=0.5) for axis in (1, 0)]
    across, down = np.asarray(steep[0]), np.asarray(steep[1])
    along_row, along_column = (s[0] * across + s[1] * down for s in spread)
    known = mean(along_row * across + along_column * down, _JOINED_RADIUS_PX)
    total = variance[0] * mean(along_row, _JOINED_RADIUS_PX) ** 2
    total += variance[1] * mean(along_column, _JOINED_RADIUS_PX) ** 2
    return total / np.maximum(known * known, np.float32(1e-12))


def _fit(
    images: NDArray[np.float32],
    splines: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    before: NDArray[np.float32] | None,
    cameras: Cameras,
    scales: Scales,
    stride_px: int,
    radius: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    return fit_drift(
        splines, images[cameras.reference], slope_px, before, cameras,
        stride_px=stride_px,
        radius=radius,
        gate_px=_GATE_LABELS * cameras.step_px,
        doubt_levels=_DOUBT * scales.doubt,
        least_tilt_levels=scales.noise / (_SLOPE_ERROR_LABELS * cameras.step_px),
    )  # fmt: skip


def _spread(drift: NDArray[np.float32], factor: int, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Interpolate between the points of a grid, or the pixels of small images."""
    middle = 0.5 * (factor - 1) / factor
    to_grid = np.array([[1 / factor, 0.0, -middle], [0.0, 1 / factor, -middle]])
    whole = np.empty((2, *shape), np.float32)
    for grid, out in zip(drift, whole, strict=True):
        cv2.warpAffine(
            grid, to_grid, (shape[1], shape[0]), dst=out,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
    return whole
