"""Whether two saddle points are the ends of one edge between black and white."""

import math

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.targets.saddles import Saddles, grey_at

_PLACES = (
    (0.5, 1.0),
    (-0.25, -1.0),
    (1.25, -1.0),
    (0.2, 1.0),
    (0.8, 1.0),
    (0.35, 1.0),
    (0.65, 1.0),
)
"""Places on the link and beyond its ends, in lengths of it, and the brighter side there: at a
corner the colours change sides; a chance point on the way does not turn them. Places that turn
most links away come first."""
_ASIDE = 0.06
"""How far beside the link to look, in lengths: a marker begins at about twice that."""
_LEAST_ASIDE_PX = 1.2
_LEAST_STEP = 0.25
"""Smallest difference across the link, in contrasts of its weaker end."""


def are_edges(
    picture: NDArray[np.float32], saddles: Saddles, first: NDArray[np.intp], last: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """(K,) whether one side of a link is brighter all along, and the other one beyond its ends.

    Args:
        picture: (H, W) grey.
        saddles: N points.
        first: (K,) index of the saddle where a link starts.
        last: (K,) where it ends.
    """
    return _are_edges(np.ascontiguousarray(picture), saddles.xy_px, saddles.contrast, first, last)


@kernel()
def _are_edges(
    picture: NDArray[np.float32],
    xy_px: Float,
    contrast: Float,
    first: NDArray[np.intp],
    last: NDArray[np.intp],
) -> NDArray[np.bool_]:
    answer = np.ones(len(first), np.bool_)
    for k in range(len(first)):
        start, end = xy_px[first[k]], xy_px[last[k]]
        step_x, step_y = end[0] - start[0], end[1] - start[1]
        length = max(math.hypot(step_x, step_y), 1e-9)
        aside = max(_ASIDE * length, _LEAST_ASIDE_PX) / length
        least = _LEAST_STEP * min(contrast[first[k]], contrast[last[k]])
        turn = 0.0
        for along, side in _PLACES:
            x, y = start[0] + along * step_x, start[1] + along * step_y
            one = _within(picture, x - aside * step_y, y + aside * step_x)
            other = _within(picture, x + aside * step_y, y - aside * step_x)
            difference = side * (one - other)
            if turn == 0.0:
                turn = 1.0 if difference > 0 else -1.0
            if not turn * difference > least:
                answer[k] = False
                break
    return answer


@kernel()
def _within(picture: NDArray[np.float32], x: float, y: float) -> float:
    """The grey level at the nearest place in the picture."""
    rows, columns = picture.shape
    return grey_at(picture, min(max(x, 0.0), columns - 1.0), min(max(y, 0.0), rows - 1.0))
