"""Where each pixel's slope roughly is: an exhaustive, a coarse or a narrow search.

Dense light fields are searched exhaustively at full size. Wide ranges of sparse arrays are searched
at half size, an eighth of the work: the line fit that follows bridges what is left. Where a
hypothesis leaves only a narrow window, only that window is searched, and where it is narrower than
one label, nothing needs to be.
"""

from dataclasses import replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.median import guided_median, near_jumps
from rig.epipolar.rank import median_of_nine
from rig.epipolar.sampling import pad, sample_views
from rig.epipolar.scales import Scales, measure_scales
from rig.epipolar.search.aggregate import aggregate, rivals, winners
from rig.epipolar.search.contrast import raise_texture, texture_levels
from rig.epipolar.search.cross_check import is_one_sided
from rig.epipolar.search.found import Found
from rig.epipolar.search.halves import HALVES, assign_halves
from rig.epipolar.search.narrow import narrow_costs
from rig.epipolar.search.pair import search_pair
from rig.epipolar.search.penalties import fading_penalties, jump_penalties
from rig.epipolar.search.plane_sweep import average, sweep_costs
from rig.epipolar.search.shrink import grow, shrink
from rig.epipolar.search.window import Cameras, Window

_COARSE_FROM_LABELS, _COARSE_SHRINK = 96, 2
_NARROW_UP_TO_LABELS = 8
FEW = 0.05
"""Share of pixels without a narrow window up to which a search of small images is enough."""
_FEW_SHRINK = 6
_CLEARLY = 0.7
_STEP_PENALTY = 9
_COARSE_MEDIAN_RADIUS_PX = 3
_FULL_MISMATCH, _TEXTURE_MISMATCH = 1.7, 0.7
_COARSE_STEP_PENALTY, _COARSE_JUMP_PENALTIES = 15, (20.0, 120.0)
"""Stronger where the pictures differ by more than noise."""


class Effort(IntEnum):
    """How much of the range a search looks at, and how closely."""

    FOLLOWED = 0
    """The surroundings of a hypothesis."""
    COARSE = 1
    """All of it at half size: it has too many labels."""
    FULL = 2
    """All of it at full size."""


def effort_of(
    cameras: Cameras, window: Window, share: float | None = None, most_share: float = FEW
) -> Effort:
    """How `search` is to look for the slopes of a window.

    Args:
        cameras: where the views stand.
        window: the slopes to search.
        share: `wide_share` of it, where it is known already.
        most_share: of unknown pixels, below which what is around the hypothesis is enough.
    """
    side = min(window.low_px.shape)
    share = wide_share(window, cameras) if share is None else share
    # Smaller pictures need two rows and two columns to be searched.
    if share == 0 or (share < most_share and side >= 2 * _FEW_SHRINK):
        return Effort.FOLLOWED
    width_px = float(window.high_px.max()) - float(window.low_px.min())
    is_wide = width_px > _COARSE_FROM_LABELS * cameras.step_px
    return Effort.COARSE if is_wide and side >= 2 * _COARSE_SHRINK else Effort.FULL


def wide_share(window: Window, cameras: Cameras) -> float:
    """Share of the pixels whose window is too wide for a narrow search."""
    wide = _is_wide(window, cameras)
    return np.count_nonzero(wide) / wide.size


def _is_wide(window: Window, cameras: Cameras) -> NDArray[np.bool_]:
    return window.is_wider(_NARROW_UP_TO_LABELS * cameras.step_px)


def search(
    images: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
    splines: NDArray[np.float32] | None = None,
    drift: NDArray[np.float32] | None = None,
    rival_px: NDArray[np.float32] | None = None,
    effort: Effort | None = None,
) -> Found:
    """Find the slope of every pixel inside its window.

    Args:
        images: (V, H, W), equalised grey values.
        cameras: where the views stand.
        window: the slopes to search.
        scales: grey scales of the images.
        splines: what `rig.epipolar.sampling.pad` makes of them, if there already.
        drift: (2, H, W) light that changes with the view, see `rig.epipolar.drift`; None for none.
            Searches of texture and around a hypothesis have no need of it.
        rival_px: (H, W) second slopes of the last multi-view: what its few unknown pixels have, and
            they are not searched now; None to search them.
        effort: how to look; None for what the window asks for.
    """
    wide = _is_wide(window, cameras)
    if effort is None:
        effort = effort_of(cameras, window, float(np.count_nonzero(wide)) / wide.size)
    if effort is not Effort.FOLLOWED and is_one_sided(cameras):
        return search_pair(images, cameras, window, scales).only(wide, window.expected_px)
    match effort:
        case Effort.FULL:
            return _search_all(images, cameras, window, scales, drift)
        case Effort.COARSE:
            found = _search_coarse(images, cameras, window, scales, drift)
            return found.only(wide, window.expected_px)
        case Effort.FOLLOWED if wide.any() and rival_px is not None:
            known_px = np.where(wide, rival_px, np.float32(np.nan))
            return Found.of_all(window.expected_px, known_px)
        case Effort.FOLLOWED if wide.any():
            if splines is None:
                splines = pad(images, cameras.x_steps, cameras.y_steps)
            return _search_few(images, splines, cameras, window, scales, wide)
        case Effort.FOLLOWED if window.widest_px() > cameras.step_px:
            return Found.alone(_search_narrow(images, cameras, window, scales))
        case Effort.FOLLOWED:
            return Found.alone(window.expected_px)


def _search_all(
    images: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
    drift: NDArray[np.float32] | None,
) -> Found:
    labels = window.labels(cameras.step_px)
    costs = sweep_costs(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, labels, scales.truncation,
        drift=drift,
    )  # fmt: skip
    return _decided(costs, labels, images[cameras.reference], window, scales)


def _decided(
    costs: NDArray[np.uint8],
    labels: NDArray[np.float32],
    grey: NDArray[np.float32],
    window: Window,
    scales: Scales,
) -> Found:
    penalties = jump_penalties(grey, scales, len(labels))
    total = aggregate(costs, *penalties, _STEP_PENALTY)
    slope = winners(total, labels, window.low_px, window.high_px)
    return Found.of_all(window.hold(median_of_nine(slope)), rivals(total, labels, slope))


def search_coarsely(
    images: NDArray[np.float32], cameras: Cameras, window: Window
) -> NDArray[np.float32]:
    """Search small pictures whose light and rows need not agree, (H, W).

    Args:
        images: (V, H, W) grey values.
        cameras: where the views stand.
        window: the slopes to search.
    """
    raised, centres = raise_texture(images, cameras)
    labels = window.labels(cameras.step_px)
    truncation = _FULL_MISMATCH * texture_levels(centres)
    steps = cameras.x_steps, cameras.y_steps
    costs = sweep_costs(raised, *steps, cameras.reference, labels, truncation, centres)
    penalties = fading_penalties(images[cameras.reference], _COARSE_JUMP_PENALTIES)
    total = aggregate(costs, *penalties, _COARSE_STEP_PENALTY)
    slope = winners(total, labels, window.low_px, window.high_px)
    return window.hold(median_of_nine(slope))


def _search_narrow(
    images: NDArray[np.float32], cameras: Cameras, window: Window, scales: Scales
) -> NDArray[np.float32]:
    middle = window.expected_px
    reach = int(np.ceil(0.5 * window.widest_px() / cameras.step_px))
    offsets = np.float32(cameras.step_px) * np.arange(-reach, reach + 1, dtype=np.float32)
    costs = narrow_costs(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, middle, offsets,
        scales.truncation,
    )  # fmt: skip
    penalties = jump_penalties(images[cameras.reference], scales, len(offsets))
    total = aggregate(costs, *penalties, _STEP_PENALTY)
    offset = winners(total, offsets, window.low_px - middle, window.high_px - middle)
    return window.hold(median_of_nine(middle + offset))


def _search_few(
    images: NDArray[np.float32],
    splines: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
    wide: NDArray[np.bool_],
) -> Found:
    """Search scattered pixels in small images; take what clearly fits better than expected."""
    rows, columns = np.divmod(np.flatnonzero(wide), wide.shape[1])
    expected = window.expected_px[rows, columns]
    small = _search_small(images, cameras, window, scales, _FEW_SHRINK)
    height, width = small.slope_px.shape
    blocks = np.minimum(rows // _FEW_SHRINK, height - 1) * width
    blocks += np.minimum(columns // _FEW_SHRINK, width - 1)
    found = np.clip(
        small.slope_px.ravel()[blocks], window.low_px[rows, columns], window.high_px[rows, columns]
    )
    both = np.concatenate([expected, found])
    twice = np.tile(rows, 2), np.tile(columns, 2)
    old, new = np.split(_misfit(splines, wide.shape, cameras, *twice, both), 2)
    slope = window.expected_px.copy()
    is_new = new < _CLEARLY * old
    slope[rows, columns] = np.where(is_new, found, expected)
    rival = np.full_like(slope, np.nan)
    rival[rows, columns] = np.where(is_new, small.rival_px.ravel()[blocks], found)
    return Found.of_all(slope, rival)


def _misfit(
    splines: NDArray[np.float32],
    shape: tuple[int, int],
    cameras: Cameras,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    slope_px: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Mean grey difference of the best half that sees each pixel of a list, (N,)."""
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    steps = cameras.x_steps, cameras.y_steps
    seen, grey = sample_views(splines, shape, *steps, rows, columns, slope_px)
    difference = np.where(seen, np.abs(grey - grey[cameras.reference]), np.float32(0))
    total = np.zeros((HALVES, len(rows)), np.float32)
    count = np.zeros((HALVES, len(rows)), np.float32)
    for i in np.flatnonzero(half >= 0):
        total[half[i]] += difference[i]
        count[half[i]] += seen[i]
    unseen = np.full_like(total, np.inf)
    return np.divide(total, count, out=unseen, where=count > 0).min(axis=0)


def _search_coarse(
    images: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
    drift: NDArray[np.float32] | None,
) -> Found:
    """Exhaustive search of images of half the size, at full size."""
    small = _search_small(images, cameras, window, scales, _COARSE_SHRINK, drift)
    slope, rival = (
        grow(part, _COARSE_SHRINK, window.low_px.shape) for part in (small.slope_px, small.rival_px)
    )
    return Found.of_all(window.hold(slope), rival)


def _search_small(
    images: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
    factor: int,
    drift: NDArray[np.float32] | None = None,
) -> Found:
    """Exhaustive search of smaller images; slopes, which shrink with pixels, are of full size.

    Half of the cost is that of the grey values, half that of their texture, which bears what no
    noise explains: reflections, light that is not the same.
    """
    small = shrink(images, factor)
    scales = replace(
        measure_scales(small, cameras.reference, scales.shrunk_noise),
        misfit_px=scales.misfit_px / factor,
    )
    narrow = window.shrunk(factor)
    labels = narrow.labels(cameras.step_px)
    steps = cameras.x_steps, cameras.y_steps
    light = None if drift is None else shrink(drift, factor)
    costs = sweep_costs(small, *steps, cameras.reference, labels, scales.truncation, drift=light)
    raised, centres = raise_texture(small, cameras)
    mismatch = _TEXTURE_MISMATCH * texture_levels(centres)
    average(costs, sweep_costs(raised, *steps, cameras.reference, labels, mismatch, centres))
    found = _decided(costs, labels, small[cameras.reference], narrow, scales)
    slope = guided_median(
        found.slope_px,
        small[cameras.reference],
        near_jumps(found.slope_px, 1.5 * cameras.step_px, _COARSE_MEDIAN_RADIUS_PX),
        radius_px=_COARSE_MEDIAN_RADIUS_PX,
        grey_scale=2.0 * scales.likeness,
    )
    return Found.of_all(np.float32(factor) * slope, np.float32(factor) * found.rival_px)
