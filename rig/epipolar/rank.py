"""Lowest, highest and middle slope of a neighbourhood, and its mean (OpenCV's filters, typed)."""

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float32]


def lowest(values: Map, radius_px: int) -> Map:
    """Minimum over a square window, (H, W)."""
    return cast("Map", cv2.erode(values, _square(radius_px)))


def highest(values: Map, radius_px: int) -> Map:
    """Maximum over a square window, (H, W)."""
    return cast("Map", cv2.dilate(values, _square(radius_px)))


def median_of_nine(values: Map) -> Map:
    """Median over 3 x 3 pixels, (H, W)."""
    return cast("Map", cv2.medianBlur(values, 3))


def jumps(values: Map, over_px: float) -> NDArray[np.bool_]:
    """Whether a value and those beside, above and below it differ by more than this, (H, W)."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    spread = cast("Map", cv2.morphologyEx(values, cv2.MORPH_GRADIENT, cross))
    return spread > np.float32(over_px)


def mean(values: Map, radius_px: int) -> Map:
    """Mean over a square window, (H, W)."""
    size = 2 * radius_px + 1
    return cast("Map", cv2.blur(values, (size, size)))


def quantile(values: NDArray[np.floating], share: float) -> float:
    """Value that a share of a short list (N,) lies below; between two ranks in proportion.

    What `numpy.quantile` says, in a fraction of the time.
    """
    place = share * (len(values) - 1)
    return float(np.interp(place, np.arange(len(values)), np.sort(values)))


def _square(radius_px: int) -> NDArray[np.uint8]:
    return np.ones((2 * radius_px + 1, 2 * radius_px + 1), np.uint8)
