"""What a pair cannot match: a point that only the reference sees takes the farther slope beside it.

Where all other views lie on one side, no spare half sees what a nearer surface hides. The search is
then repeated from the outermost view, and slopes that the two do not share are replaced: the
left-right check and background fill of Hirschmuller, "Stereo processing by semiglobal matching and
mutual information" (IEEE TPAMI 30(2), 2008).
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.halves import assign_halves
from rig.epipolar.scales import Scales
from rig.epipolar.search import search
from rig.epipolar.window import Cameras, Window

_SHARED_LABELS = 2.5
"""Difference up to which two searches found the same, labels; a half-size search is that coarse."""


def is_one_sided(cameras: Cameras) -> bool:
    """Whether all other views lie on one side of the reference."""
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    return len(set(half[half >= 0].tolist())) == 1


def fill_unshared(
    images: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    cameras: Cameras,
    window: Window,
    scales: Scales,
) -> NDArray[np.float32]:
    """Replace slopes that a search from the outermost view does not confirm, (H, W).

    Args:
        images: (V, H, W) equalised grey values.
        slope_px: (H, W) what the search found, px per view step.
        cameras: where the views stand, all on one side of the reference.
        window: where the search looked; the check looks at all of its range.
        scales: grey scales of the images.
    """
    other = int(np.argmax(np.hypot(cameras.x_steps, cameras.y_steps)))
    x_step, y_step = float(cameras.x_steps[other]), float(cameras.y_steps[other])
    seen_from = Cameras(cameras.x_steps - x_step, cameras.y_steps - y_step, other)
    low, high = (np.full_like(slope_px, end) for end in (window.low_px.min(), window.high_px.max()))
    there = search(images, seen_from, Window(low, high, 0.5 * (low + high)), scales)
    height, width = slope_px.shape
    rows, columns = np.mgrid[0:height, 0:width]
    column = np.rint(columns - slope_px * np.float32(x_step)).astype(int)
    row = np.rint(rows - slope_px * np.float32(y_step)).astype(int)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    found = there[np.where(inside, row, 0), np.where(inside, column, 0)]
    shared = inside & (np.abs(found - slope_px) <= _SHARED_LABELS * cameras.step_px)
    if abs(x_step) >= abs(y_step):
        return _fill_rows(slope_px, shared)
    return np.ascontiguousarray(_fill_rows(slope_px.T, shared.T).T)


def _fill_rows(slope_px: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Give what is not known the farther of its nearest known neighbours in the row."""
    before, after = _last_known(slope_px, known), _last_known(slope_px[:, ::-1], known[:, ::-1])
    beside = np.minimum(before, after[:, ::-1])
    return np.where(known | np.isinf(beside), slope_px, beside)


def _last_known(slope_px: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Slope of the nearest known pixel at or before each pixel of its row; infinite if none."""
    index = np.where(known, np.arange(known.shape[1]), -1)
    last = np.maximum.accumulate(index, axis=1)
    slopes = np.take_along_axis(slope_px, np.maximum(last, 0), axis=1)
    return np.where(last >= 0, slopes, np.float32(np.inf))
