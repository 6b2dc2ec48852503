"""Closes the holes of a disparity map, for comparisons at full density."""

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float32]


def fill_background(disparity_px: Map) -> Map:
    """Give every hole the farther of its neighbours.

    A hole in a row takes the smaller disparity of the nearest answers on either side, because what
    one view does not see lies behind what hides it; at the border the only neighbour counts. Rows
    without any answer take that of the nearest row, by the same rule. This is how the KITTI stereo
    benchmark makes sparse maps dense (Geiger, Lenz and Urtasun, CVPR 2012, development kit).

    Args:
        disparity_px: (H, W) of the left image, NaN for holes.

    Returns:
        (H, W) without holes, unless there was no answer at all.
    """
    return _fill_rows(_fill_rows(disparity_px).T).T


def _fill_rows(values: Map) -> Map:
    before = _last_known(values)
    after = _last_known(values[:, ::-1])[:, ::-1]
    return np.where(np.isnan(values), np.fmin(before, after), values)


def _last_known(values: Map) -> Map:
    """At every place the nearest answer at or before it in its row, NaN where there is none."""
    columns = np.arange(values.shape[1])
    place = np.maximum.accumulate(np.where(np.isnan(values), 0, columns), axis=1)
    return np.take_along_axis(values, place, axis=1)
