"""Black quadrilaterals in a picture: what may be a tag.

Tags touch the small squares at their corners. A threshold below the middle between the darkest and
the brightest grey nearby parts them: at the corner itself a picture is half dark, half bright.
"""

import cv2
import numpy as np

from rig.arrays import Float
from rig.targets.pyramid import Picture

_WINDOW_PX = 15
"""Where the darkest and the brightest grey are looked for: more than a gap or a border is wide."""
_DARK_SHARE = 0.35
"""Between the darkest and the brightest, below which a pixel is black."""
_LEAST_CONTRAST = 12.0
"""Grey levels between them, below which there is no edge."""
_SHORTEST_PX = 12.0
"""Side of a tag; its bits are not told apart in a smaller one."""
_LOOSE = 0.05
"""How far an outline may leave a straight side, over its length around."""
_MOST_OUTLINES = 3000
"""Longest outlines looked at: it bounds the work."""


def find_quads(picture: Picture) -> Float:
    """(Q, 4, 2) corners of black quadrilaterals, clockwise in the picture, to about a pixel.

    Args:
        picture: (H, W) grey, one level of a pyramid.
    """
    box = np.ones((_WINDOW_PX, _WINDOW_PX), np.uint8)
    darkest, brightest = cv2.erode(picture, box), cv2.dilate(picture, box)
    reach = brightest - darkest
    black = (picture < darkest + _DARK_SHARE * reach) & (reach > _LEAST_CONTRAST)
    outlines, _ = cv2.findContours(black.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    long = [outline for outline in outlines if len(outline) > 3.0 * _SHORTEST_PX]
    long.sort(key=len, reverse=True)
    quads = [_quad(outline) for outline in long[:_MOST_OUTLINES]]
    found = [quad for quad in quads if quad is not None]
    return np.stack(found) if found else np.empty((0, 4, 2))


def _quad(outline: np.ndarray) -> Float | None:
    around_px = cv2.arcLength(outline, closed=True)
    corners = cv2.approxPolyDP(outline, _LOOSE * around_px, closed=True).reshape(-1, 2)
    if len(corners) != 4 or not cv2.isContourConvex(corners):
        return None
    quad = corners.astype(np.float64)
    sides_px = np.linalg.norm(np.roll(quad, -1, axis=0) - quad, axis=1)
    if sides_px.min() < _SHORTEST_PX / 2 or sides_px.max() < _SHORTEST_PX:
        return None
    (ax, ay), (bx, by) = quad[1] - quad[0], quad[2] - quad[0]
    clockwise = quad if ax * by - ay * bx > 0 else quad[::-1]
    # The threshold draws the outline a little inside of the edge.
    middle = clockwise.mean(axis=0)
    away = clockwise - middle
    return middle + away * (1.0 + 0.5 / np.linalg.norm(away, axis=1, keepdims=True))
