"""Dark ellipses in a picture: what may be a circle of the grid."""

import cv2
import numpy as np

from rig.arrays import Float
from rig.targets.pyramid import Picture

_WINDOW_PX = 15
"""Where the darkest and the brightest grey are looked for: more than an edge is wide."""
_LEAST_CONTRAST = 12.0
"""Grey levels between them, below which there is no edge."""
_LEAST_AREA_PX2 = 20.0
_MOST_SHARE = 0.1
"""Of the picture, above which nothing is a circle of a grid."""
_MOST_OFF = 0.12
"""Relative difference of an outline's area from that of its ellipse."""
_LEAST_RATIO = 0.25
"""Of the axes: circles that are seen more steeply cannot be measured."""
_MOST_BLOBS = 600
"""Largest ones kept: it bounds the work."""


def find_blobs(picture: Picture) -> Float:
    """(B, 2) middles of dark ellipses, px, largest first.

    Args:
        picture: (H, W) grey, one level of a pyramid.
    """
    box = np.ones((_WINDOW_PX, _WINDOW_PX), np.uint8)
    darkest, brightest = cv2.erode(picture, box), cv2.dilate(picture, box)
    black = picture < (darkest + brightest) / 2
    black &= brightest - darkest > _LEAST_CONTRAST
    outlines, hierarchy = cv2.findContours(
        black.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    if not outlines:
        return np.empty((0, 2))
    parents = np.asarray(hierarchy).reshape(-1, 4)[:, 3]
    found: list[tuple[float, float, float]] = []
    for outline, parent in zip(outlines, parents.tolist(), strict=True):
        if parent >= 0 or len(outline) < 8:
            continue
        # Outlines go through the middles of the outermost pixels: half a pixel inside.
        area_px2 = cv2.contourArea(outline) + len(outline) / 2
        if not _LEAST_AREA_PX2 <= area_px2 <= _MOST_SHARE * picture.size:
            continue
        (x, y), (one, other), _ = cv2.fitEllipse(outline)
        whole_px2 = np.pi / 4 * (one + 1) * (other + 1)
        is_ellipse = abs(area_px2 / whole_px2 - 1.0) < _MOST_OFF
        if is_ellipse and min(one, other) > _LEAST_RATIO * max(one, other):
            found.append((area_px2, x, y))
    found.sort(reverse=True)
    return np.array([(x, y) for _, x, y in found[:_MOST_BLOBS]]).reshape(-1, 2)
