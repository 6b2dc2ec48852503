"""Whether two saddle points are the ends of one edge between black and white."""

import numpy as np
from numpy.typing import NDArray

from rig.targets.saddles import Saddles, bilinear

_PLACES = (
    (0.5, 1),
    (-0.25, -1),
    (1.25, -1),
    (0.2, 1),
    (0.8, 1),
    (0.35, 1),
    (0.65, 1),
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
    start = saddles.xy_px[first]
    step = saddles.xy_px[last] - start
    length = np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-9)
    normal = np.stack([-step[:, 1], step[:, 0]], axis=1) / length[:, None]
    aside = np.maximum(_ASIDE * length, _LEAST_ASIDE_PX)[:, None] * normal
    least = _LEAST_STEP * np.minimum(saddles.contrast[first], saddles.contrast[last])
    top = np.array(picture.shape[::-1]) - 1
    left = np.arange(len(first))
    turn = np.ones(len(first))
    for along, side in _PLACES:
        on = start[left] + along * step[left]
        one, other = (np.clip(on + way * aside[left], 0, top) for way in (1, -1))
        difference = side * (bilinear(picture, one) - bilinear(picture, other))
        if along == _PLACES[0][0]:
            turn = np.sign(difference)
        kept = turn * difference > least[left]
        left, turn = left[kept], turn[kept]
    answer = np.zeros(len(first), np.bool_)
    answer[left] = True
    return answer
