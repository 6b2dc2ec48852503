"""What a pair cannot match: a point that only the reference sees takes the farther slope beside it.

Where all other views lie on one side, no spare half sees what a nearer surface hides. The costs
summed for the reference are read once more along the lines of the outermost view, and slopes that
the two do not share are replaced: the left-right check and background fill of Hirschmuller, "Stereo
processing by semiglobal matching and mutual information" (IEEE TPAMI 30(2), 2008).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.epipolar.search.halves import assign_halves
from rig.epipolar.search.window import Cameras

_SHARED_PX = 0.75
"""Difference up to which both readings found the same, as a shift in the outermost view, beyond the
distance of the labels."""
_AROUND_PX = 1
"""The other view is read once per pixel, whole labels apart: where neighbours there confirm a
slope, it is unsure, not unseen."""


class Confirmed(NamedTuple):
    """What the outermost view says of the slopes of the reference."""

    shared: NDArray[np.bool_]
    """(H, W) it finds the same where they show it."""
    seen: NDArray[np.bool_]
    """(H, W) it finds the same there or, where it finds another slope, beside that."""
    apart_px: NDArray[np.float32]
    """(H, W) by how much the two differ, beyond how labels round; 0 where they share the slope, and
    where no label shows there."""


def is_one_sided(cameras: Cameras) -> bool:
    """Whether all other views lie on one side of the reference."""
    half = assign_halves(cameras.x_steps, cameras.y_steps)
    return len(set(half[half >= 0].tolist())) == 1


def shared_slopes(
    total: NDArray[np.int16],
    labels_px: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    cameras: Cameras,
) -> Confirmed:
    """Which slopes the outermost view finds too.

    Args:
        total: (H, L, W) summed costs.
        labels_px: (L,) evenly spaced slopes.
        slope_px: (H, W) what the reference finds.
        cameras: where the views stand, all on one side of the reference.
    """
    reach = np.hypot(cameras.x_steps, cameras.y_steps)
    other = int(np.argmax(reach))
    x_step, y_step = float(cameras.x_steps[other]), float(cameras.y_steps[other])
    there = _winners_of_other(
        total, np.rint(labels_px * x_step).astype(np.int64),
        np.rint(labels_px * y_step).astype(np.int64),
    )  # fmt: skip
    step_px = float(labels_px[1] - labels_px[0])
    own, near = (np.empty_like(slope_px) for _ in range(2))
    run_in_bands(
        lambda start, stop: _compare(
            there, labels_px, slope_px, np.float32(x_step), np.float32(y_step), start, stop, own,
            near,
        ),
        len(slope_px),
    )  # fmt: skip
    half_px = np.float32(0.5 * step_px)
    limit_px = np.float32(_SHARED_PX / float(reach[other])) + half_px
    shared = own <= limit_px
    apart_px = np.where(shared | np.isinf(own), np.float32(0), own - half_px)
    return Confirmed(shared, (near <= limit_px) & np.isfinite(own), apart_px)


def fill_unshared(
    slope_px: NDArray[np.float32], shared: NDArray[np.bool_], cameras: Cameras
) -> NDArray[np.float32]:
    """Replace slopes (H, W) that are not shared by the farther of those beside them."""
    other = int(np.argmax(np.hypot(cameras.x_steps, cameras.y_steps)))
    if abs(cameras.x_steps[other]) >= abs(cameras.y_steps[other]):
        return _fill_rows(slope_px, shared)
    return np.ascontiguousarray(_fill_rows(slope_px.T, shared.T).T)


@kernel()
def _winners_of_other(
    total: NDArray[np.int16], right: NDArray[np.int64], down: NDArray[np.int64]
) -> NDArray[np.int16]:
    """Label of the lowest summed cost at every pixel of the other view; -1 where none shows.

    A point of the reference lies `right` and `down` px before its own place there, by its label.
    """
    height, labels, width = total.shape
    best = np.full((height, width), np.int16(32767), np.int16)
    index = np.full((height, width), np.int16(-1), np.int16)
    for v in range(height):
        for label in range(labels):
            row = v - down[label]
            if 0 <= row < height:
                shift = right[label]
                first, last = max(0, -shift), min(width, width - shift)
                if last > first:
                    cost = total[v, label, first + shift : last + shift]
                    lowest, here = best[row, first:last], index[row, first:last]
                    for u in range(last - first):
                        better = cost[u] < lowest[u]
                        lowest[u] = cost[u] if better else lowest[u]
                        here[u] = np.int16(label) if better else here[u]
    return index


@kernel()
def _compare(
    there: NDArray[np.int16],
    labels_px: NDArray[np.float32],
    slope_px: NDArray[np.float32],
    x_step: np.float32,
    y_step: np.float32,
    start: int,
    stop: int,
    own: NDArray[np.float32],
    near: NDArray[np.float32],
) -> None:
    """Fill rows of the difference to the label `there`, and to the nearest of those around that."""
    height, width = slope_px.shape
    infinite, reach = np.float32(np.inf), _AROUND_PX
    for v in range(start, stop):
        for u in range(width):
            m = slope_px[v, u]
            row, column = round(v - m * y_step), round(u - m * x_step)
            here, best = infinite, infinite
            if 0 <= row < height and 0 <= column < width:
                for y in range(max(row - reach, 0), min(row + reach + 1, height)):
                    for x in range(max(column - reach, 0), min(column + reach + 1, width)):
                        k = there[y, x]
                        gap = abs(labels_px[k] - m) if k >= 0 else infinite
                        best = min(best, gap)
                        here = gap if (y == row) & (x == column) else here
            own[v, u], near[v, u] = here, best


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
