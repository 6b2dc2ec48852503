"""The part of a picture in which something small is likely, at twice its size."""

import cv2
import numpy as np

from rig.arrays import Float
from rig.targets.pyramid import Picture

_WINDOW_PX = 384
"""Side of the part: a board of 12 squares of 20 px, turned, which the picture itself shows well.
It bounds the work to that on a picture of 768 x 768."""
_CELL_PX = 32
"""Windows are tried in steps of this."""
_FEWEST = 12
"""Points below which nothing small is there."""


def densest_part(picture: Picture, xy_px: Float) -> tuple[Picture, Float] | None:
    """Return the window with most points at twice its size, and its first pixel (x, y).

    Args:
        picture: (H, W) grey.
        xy_px: (N, 2) points that crowd where something small is.

    Returns:
        None where there are too few points. A place p of the part is at
        `from_level(p, -1)` from its first pixel.
    """
    if len(xy_px) < _FEWEST:
        return None
    rows, columns = (-(-side // _CELL_PX) for side in picture.shape)
    column, row = (xy_px / _CELL_PX).astype(np.intp).T
    count = np.zeros((rows + 1, columns + 1), np.intp)
    np.add.at(count, (np.clip(row, 0, rows - 1) + 1, np.clip(column, 0, columns - 1) + 1), 1)
    summed = count.cumsum(axis=0).cumsum(axis=1)
    span = _WINDOW_PX // _CELL_PX
    high, wide = min(span, rows), min(span, columns)
    inside = summed[high:, wide:] - summed[:-high, wide:] - summed[high:, :-wide]
    inside = inside + summed[:-high, :-wide]
    # Of windows with as many points the middle one: the board is not cut off at its border.
    best = np.argwhere(inside == inside.max())
    middle = np.abs(best - best.mean(axis=0)).sum(axis=1).argmin()
    row, column = (int(place) for place in best[middle] * _CELL_PX)
    part = picture[row : row + high * _CELL_PX, column : column + wide * _CELL_PX]
    size = (part.shape[1] * 2, part.shape[0] * 2)
    large = cv2.resize(part, size, interpolation=cv2.INTER_CUBIC)
    return large.astype(np.float32, copy=False), np.array([column, row], np.float64)
