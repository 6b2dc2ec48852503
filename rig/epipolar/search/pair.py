"""The search of a pair: at full size, along eight paths, checked from the other view.

Where all other views lie on one side of the reference, no spare half sees what is hidden, and with
one difference per pixel a cost is a weak witness. More paths and softer texture take the place of
the views that are not there; labels a pixel apart keep the work down.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar.rank import median_of_nine
from rig.epipolar.scales import Scales
from rig.epipolar.search.aggregate import add_diagonals, aggregate, rivals, winners
from rig.epipolar.search.census import join_census
from rig.epipolar.search.contrast import raise_texture, texture_levels
from rig.epipolar.search.cross_check import fill_unshared, shared_slopes
from rig.epipolar.search.found import Found
from rig.epipolar.search.narrow import narrow_costs
from rig.epipolar.search.penalties import fading_penalties
from rig.epipolar.search.plane_sweep import average, sweep_costs
from rig.epipolar.search.shrink import grow, shrink
from rig.epipolar.search.window import LABEL_SHIFT_PX, Cameras, Window

LABELS_PX = 1.0
"""Distance of the labels, as a shift in the outermost view."""
_SOFT_PX = 0.6
_STEP_PENALTY, _JUMP_PENALTIES = 40, (80.0, 290.0)
_TEXTURE_MISMATCH, _GREY_MISMATCH = 1.7, 1.0
PAIR_ERROR_PX = LABELS_PX / 12**0.5
"""Error of slopes anywhere about their label, as a shift in the outermost view, 1 sigma."""
_CENSUS_SHARE, _ALIKE_CENSUS_SHARE = 2 / 3, 1 / 3
"""Noise that is alike in neighbours (JPEG, denoising) looks like structure: there it counts less,
and all is compared a little softer."""
_CLOSER_STEP, _CLOSER_REACH = 0.5, 3
"""After a search at half size: labels, of its own, and how many of them either way."""
_LARGEST_VOLUME = 1.3e8
"""Costs up to which it is searched at full size: four bytes each at most."""


def search_pair(
    images: NDArray[np.float32], cameras: Cameras, window: Window, scales: Scales
) -> Found:
    """Find the slope of every pixel where all other views lie on one side.

    Args:
        images: (V, H, W), equalised grey values.
        cameras: where the views stand.
        window: the slopes to search.
        scales: grey scales of the images.
    """
    height, width = images.shape[1:]
    step_px = LABELS_PX / LABEL_SHIFT_PX * cameras.step_px
    volume = height * width * len(_whole_labels(window, step_px))
    factor = 1 + int(volume > _LARGEST_VOLUME)
    small, whole = shrink(images, factor), window
    if factor > 1:
        window = window.shrunk(factor)
    labels = _whole_labels(window, step_px)
    costs = _costs(small, cameras, labels, scales, is_whole=factor == 1)
    penalties = fading_penalties(small[cameras.reference], _JUMP_PENALTIES)
    total = aggregate(costs, *penalties, _STEP_PENALTY)
    add_diagonals(costs, *penalties, _STEP_PENALTY, total)
    slope = winners(total, labels, window.low_px, window.high_px)
    rival, slope = rivals(total, labels, slope), window.hold(median_of_nine(slope))
    shared, seen, apart = shared_slopes(total, labels, slope, cameras)
    filled = fill_unshared(slope, shared, cameras)
    apart, slope = np.maximum(apart, np.abs(filled - slope)), filled
    if factor > 1:
        shape = (height, width)
        slope, rival, apart = (
            np.float32(factor) * grow(part, factor, shape) for part in (slope, rival, apart)
        )
        seen = grow(seen.astype(np.float32), factor, shape) > 0
        slope = whole.hold(_closer(images, cameras, slope, step_px, is_alike=scales.is_alike))
    return Found(slope, rival, ~seen, apart)


def _closer(
    images: NDArray[np.float32],
    cameras: Cameras,
    slope_px: NDArray[np.float32],
    step_px: float,
    *,
    is_alike: bool,
) -> NDArray[np.float32]:
    """Look once more at full size, around slopes (H, W) from half of it."""
    raised, centres = raise_texture(_softened(images) if is_alike else images, cameras)
    is_row = bool(np.abs(cameras.x_steps).max() >= np.abs(cameras.y_steps).max())
    raised[cameras.reference] = centres[0 if is_row else 1]
    labels = np.arange(-_CLOSER_REACH, _CLOSER_REACH + 1, dtype=np.float32)
    offsets = np.float32(_CLOSER_STEP * step_px) * labels
    steps = cameras.x_steps, cameras.y_steps
    mismatch = _TEXTURE_MISMATCH * texture_levels(centres)
    costs = narrow_costs(raised, *steps, cameras.reference, slope_px, offsets, mismatch)
    step_penalty = int(_CLOSER_STEP * _STEP_PENALTY)
    penalties = fading_penalties(images[cameras.reference], _JUMP_PENALTIES)
    total = aggregate(costs, *penalties, step_penalty)
    add_diagonals(costs, *penalties, step_penalty, total)
    bound = np.full(slope_px.shape, offsets[-1], np.float32)
    return median_of_nine(slope_px + winners(total, offsets, -bound, bound))


def _softened(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Pictures whose noise is alike in neighbours, so that it looks like structure, smoothed."""
    return np.stack([cv2.GaussianBlur(image, (0, 0), _SOFT_PX) for image in images])


def _whole_labels(window: Window, step_px: float) -> NDArray[np.float32]:
    """Slopes (L,) that shift the outermost view by whole pixels, to both ends of the window."""
    first = int(np.floor(float(window.low_px.min()) / step_px))
    last = int(np.ceil(float(window.high_px.max()) / step_px))
    return (step_px * np.arange(first, max(last, first + 2) + 1)).astype(np.float32)


def _costs(
    images: NDArray[np.float32],
    cameras: Cameras,
    labels: NDArray[np.float32],
    scales: Scales,
    *,
    is_whole: bool,
) -> NDArray[np.uint8]:
    """Cost (H, L, W) of softened texture, and of grey values where they are to be trusted."""
    # Means of blocks, which smaller pictures are, have little left of it.
    is_alike = scales.is_alike and is_whole
    soft = _softened(images) if is_alike else images
    raised, centres = raise_texture(soft, cameras)
    steps = cameras.x_steps, cameras.y_steps
    mismatch = _TEXTURE_MISMATCH * texture_levels(centres)
    costs = sweep_costs(raised, *steps, cameras.reference, labels, mismatch, centres)
    if scales.misfit_px == 0 and not scales.is_alike and is_whole:
        # Views that differ by no more than noise can be compared as they are, too.
        grey_mismatch = _GREY_MISMATCH * scales.truncation
        average(costs, sweep_costs(images, *steps, cameras.reference, labels, grey_mismatch))
    share = _ALIKE_CENSUS_SHARE if is_alike else _CENSUS_SHARE
    join_census(costs, soft, cameras, labels, scales.noise, share)
    return costs
