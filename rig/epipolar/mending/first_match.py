"""A first, coarse match of small pictures, before light and rows are known to agree.

At a quarter of the size rows that miss by pixels meet, and what the search compares hardly sees
light (`rig.epipolar.search.contrast`). What it tells pairs the pixels from which light, rows and
noise are measured.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.search.search import search_coarsely, wide_share
from rig.epipolar.search.shrink import shrink
from rig.epipolar.search.window import Cameras, Window
from rig.epipolar.views import Image

Map = NDArray[np.float32]

_SHRINK = 4
_MIN_SIDE_PX = 48
_FEW_UNKNOWN = 0.3


@dataclass(frozen=True, slots=True)
class FirstMatch:
    """Pictures with the slopes of smaller ones."""

    pictures: Image
    """(V, H, W) grey values at full size."""
    factor: int
    """How many times smaller those are that were matched."""
    slope_px: Map
    """(H // factor, W // factor) in their own pixels per view step."""
    is_told: bool
    """Whether the slopes are those of a hypothesis: nothing was searched."""

    @property
    def images(self) -> Map:
        """(V, H // factor, W // factor) mean grey values; few followed frames ask for them."""
        return small_pictures(self.pictures, self.factor)


def small_pictures(images: Image, factor: int) -> Map:
    """Mean grey values over blocks of pictures (V, H, W)."""
    return shrink(images, factor).astype(np.float32)


def first_match(images: Image, cameras: Cameras, window: Window) -> FirstMatch:
    """Match views at a quarter of their size.

    Where nearly all slopes are known already, the hypothesis is the match.

    Args:
        images: (V, H, W) grey values as they come.
        cameras: where the views stand.
        window: the slopes to search.
    """
    factor = min(_SHRINK, max(1, min(images.shape[1:]) // _MIN_SIDE_PX))
    small_window = window.shrunk(factor)
    is_told = wide_share(small_window, cameras) <= _FEW_UNKNOWN
    slope_px = small_window.expected_px
    if not is_told:
        slope_px = search_coarsely(small_pictures(images, factor), cameras, small_window)
    return FirstMatch(images, factor, slope_px, is_told)
