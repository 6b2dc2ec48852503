"""Whether two saddle points are the ends of one edge between black and white."""

import numpy as np
from numpy.typing import NDArray

from rig.geometry.saddles import Saddles, bilinear

Float = NDArray[np.float64]

_ALONG = np.array([-0.25, 0.2, 0.35, 0.5, 0.65, 0.8, 1.25])
"""Places on the link, in lengths of it, and beyond its ends."""
_SIDE = np.array([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0, -1.0])
"""At a corner the colours change sides; a chance point on the way does not turn them."""
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
    length = np.maximum(np.linalg.norm(step, axis=1), 1e-9)
    normal = np.stack([-step[:, 1], step[:, 0]], axis=1) / length[:, None]
    aside = np.maximum(_ASIDE * length, _LEAST_ASIDE_PX)[:, None] * normal
    on = start[:, None] + _ALONG[:, None] * step[:, None]
    top = np.array(picture.shape[::-1]) - 1
    left, right = (
        bilinear(picture, np.clip(on + side[:, None], 0, top)) for side in (aside, -aside)
    )
    difference = (left - right) * _SIDE
    weaker = np.minimum(saddles.contrast[first], saddles.contrast[last])[:, None]
    up = (difference > _LEAST_STEP * weaker).all(axis=1)
    down = (difference < -_LEAST_STEP * weaker).all(axis=1)
    return np.logical_or(up, down)
