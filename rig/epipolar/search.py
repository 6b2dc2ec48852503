"""Where each pixel's slope roughly is: an exhaustive, a coarse or a narrow search.

Dense light fields are searched exhaustively at full size. Wide ranges of sparse arrays are searched
at half size, an eighth of the work: the line fit that follows bridges what is left. Where a
hypothesis leaves only a narrow window, only that window is searched, and where it is narrower than
one label, nothing needs to be.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.aggregate import aggregate, winners
from rig.epipolar.halves import HALVES, assign_halves
from rig.epipolar.median import guided_median, near_jumps
from rig.epipolar.narrow import narrow_costs
from rig.epipolar.rank import median_of_nine
from rig.epipolar.sampling import pad, sample_views
from rig.epipolar.scales import Scales, measure_scales
from rig.epipolar.shrink import grow, shrink
from rig.epipolar.sweep import sweep_costs
from rig.epipolar.window import Cameras, Window

_COARSE_FROM_LABELS = 96
_NARROW_UP_TO_LABELS = 8
_FEW = 0.05
"""Share of pixels without a narrow window up to which a search of small images is enough."""
_FEW_SHRINK = 6
_CLEARLY = 0.7
_STEP_PENALTY, _LOW_PENALTY, _JUMP_PENALTY = 9, 8, 24
_JUMP_PER_LABEL = 0.4
"""The more labels there are to jump to, the more often one of them fits by chance."""
_COARSE_MEDIAN_RADIUS_PX = 3


class Effort(IntEnum):
    """How much of the range a search looks at, and how closely."""

    FOLLOWED = 0
    """The surroundings of a hypothesis."""
    COARSE = 1
    """All of it at half size: it has too many labels."""
    FULL = 2
    """All of it at full size."""


def effort_of(cameras: Cameras, window: Window) -> Effort:
    """How `search` will look for the slopes of a window."""
    if wide_share(window, cameras) < _FEW:
        return Effort.FOLLOWED
    width_px = float(window.high_px.max()) - float(window.low_px.min())
    return Effort.COARSE if width_px > _COARSE_FROM_LABELS * cameras.step_px else Effort.FULL


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
) -> NDArray[np.float32]:
    """Slope of every pixel to within about a label, (H, W), inside its window.

    Args:
        images: (V, H, W), equalised grey values.
        cameras: where the views stand.
        window: the slopes to search.
        scales: grey scales of the images.
        splines: what `rig.epipolar.sampling.pad` makes of them, if there already.
    """
    wide = _is_wide(window, cameras)
    match effort_of(cameras, window):
        case Effort.FULL:
            return _search_all(images, cameras, window, scales)
        case Effort.COARSE:
            return np.where(wide, _search_coarse(images, cameras, window, 2), window.expected_px)
        case Effort.FOLLOWED if wide.any():
            if splines is None:
                splines = pad(images, cameras.x_steps, cameras.y_steps)
            return _search_few(images, splines, cameras, window, wide)
        case Effort.FOLLOWED if window.widest_px() > cameras.step_px:
            return _search_narrow(images, cameras, window, scales)
        case Effort.FOLLOWED:
            return window.expected_px


def _labels(low_px: float, high_px: float, step_px: float) -> NDArray[np.float32]:
    count = max(3, int(np.ceil((high_px - low_px) / step_px)) + 1)
    return np.linspace(low_px, high_px, count).astype(np.float32)


def _search_all(
    images: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
) -> NDArray[np.float32]:
    labels = _labels(float(window.low_px.min()), float(window.high_px.max()), cameras.step_px)
    costs = sweep_costs(
        images, cameras.x_steps, cameras.y_steps, cameras.reference, labels, scales.truncation
    )
    penalties = _jump_penalties(images[cameras.reference], scales, len(labels))
    slope = winners(
        aggregate(costs, *penalties, _STEP_PENALTY), labels, window.low_px, window.high_px
    )
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
    penalties = _jump_penalties(images[cameras.reference], scales, len(offsets))
    total = aggregate(costs, *penalties, _STEP_PENALTY)
    offset = winners(total, offsets, window.low_px - middle, window.high_px - middle)
    return window.hold(median_of_nine(middle + offset))


def _search_few(
    images: NDArray[np.float32],
    splines: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    wide: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """Search scattered pixels in small images; take what clearly fits better than expected."""
    rows, columns = np.divmod(np.flatnonzero(wide), wide.shape[1])
    expected = window.expected_px[rows, columns]
    small = _search_small(images, cameras, window, _FEW_SHRINK)
    height, width = small.shape
    blocks = np.minimum(rows // _FEW_SHRINK, height - 1) * width
    blocks += np.minimum(columns // _FEW_SHRINK, width - 1)
    found = np.clip(
        small.ravel()[blocks], window.low_px[rows, columns], window.high_px[rows, columns]
    )
    both = np.concatenate([expected, found])
    twice = np.tile(rows, 2), np.tile(columns, 2)
    old, new = np.split(_misfit(splines, wide.shape, cameras, *twice, both), 2)
    slope = window.expected_px.copy()
    slope[rows, columns] = np.where(new < _CLEARLY * old, found, expected)
    return slope


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
    images: NDArray[np.float32], cameras: Cameras, window: Window, factor: int
) -> NDArray[np.float32]:
    """Exhaustive search of smaller images, at full size."""
    small = _search_small(images, cameras, window, factor)
    return window.hold(grow(small, factor, window.low_px.shape))


def _search_small(
    images: NDArray[np.float32], cameras: Cameras, window: Window, factor: int
) -> NDArray[np.float32]:
    """Exhaustive search of smaller images; slopes, which shrink with pixels, are of full size."""
    small = shrink(images, factor)
    scales = measure_scales(small, cameras.reference)
    slope = _search_all(small, cameras, window.shrunk(factor), scales)
    slope = guided_median(
        slope,
        small[cameras.reference],
        near_jumps(slope, 1.5 * cameras.step_px, _COARSE_MEDIAN_RADIUS_PX),
        radius_px=_COARSE_MEDIAN_RADIUS_PX,
        grey_scale=2.0 * scales.likeness,
    )
    return np.float32(factor) * slope


def _jump_penalties(
    grey: NDArray[np.float32], scales: Scales, labels: int
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Penalty between a pixel and its left neighbour, and between it and the one above."""
    high = max(_JUMP_PENALTY, _LOW_PENALTY + _JUMP_PER_LABEL * labels)
    penalties: list[NDArray[np.int16]] = []
    for axis in (1, 0):
        edge = np.abs(np.diff(grey, axis=axis, prepend=grey.take([0], axis=axis)))
        fade = np.exp(-edge / np.float32(scales.likeness))
        penalties.append((_LOW_PENALTY + (high - _LOW_PENALTY) * fade).astype(np.int16))
    return penalties[0], penalties[1]
