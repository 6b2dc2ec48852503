"""A picture at several resolutions, and places in it."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

Image = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]
Picture = NDArray[np.float32]

_SMALLEST_SIDE_PX = 64
_HALVED_FIRST_PX = 500_000
"""Pictures of more pixels are searched at half resolution first: a quarter of the work."""


def pyramid(image: Image, levels: int) -> list[Picture]:
    """Return the picture, half of it, a quarter of it: at most so many, none needlessly small."""
    picture = np.ascontiguousarray(image, np.float32)
    pictures = [picture]
    while len(pictures) < levels and min(picture.shape) >= _SMALLEST_SIDE_PX:
        height, width = picture.shape
        even = picture[: height // 2 * 2, : width // 2 * 2]
        picture = cv2.resize(even, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
        picture = picture.astype(np.float32, copy=False)
        pictures.append(picture)
    return pictures


def search_order(pictures: list[Picture]) -> list[int]:
    """Levels in the order in which a search answers soonest."""
    order = list(range(len(pictures)))
    if len(order) > 1 and pictures[0].size > _HALVED_FIRST_PX:
        order[:2] = [1, 0]
    return order


def at_level(xy_px: Float, level: int) -> Float:
    """Places (..., 2) of the picture itself, in px of a level."""
    scale = 2**level
    return (xy_px - (scale - 1) / 2) / scale


def from_level(xy_px: Float, level: int) -> Float:
    """Places (..., 2) in px of a level, in px of the picture itself."""
    scale = 2**level
    return xy_px * scale + (scale - 1) / 2
