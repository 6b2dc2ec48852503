"""Whether a patch shows no more than noise: then nothing can be told there.

The sum of N squares of noise has a standard deviation of the root of 2 / N of itself; texture has
to exceed what noise pretends by several of these.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_side_by_side
from rig.epipolar.line import LineFits
from rig.epipolar.rank import mean
from rig.epipolar.scales import Scales
from rig.epipolar.search.shrink import grow, shrink

Map = NDArray[np.float32]

_RADIUS_PX, _CHANCE_SIGMAS, _ALIKE_PX = 8, 4.0, 4.0
"""Information in a patch must exceed what noise alone pretends by so many sigmas of that, where so
many neighbours have one noise."""
_SHRINK = 2


def is_plain(lines: LineFits, views: int) -> NDArray[np.bool_]:
    """Where the texture of a patch is no more than noise alone pretends, as the lines.

    Args:
        lines: the fit of every pixel's own line.
        views: how many there are.
    """
    signal, every = run_side_by_side(
        lambda: lines.around(lines.signal, _RADIUS_PX),
        lambda: lines.around(lines.information, _RADIUS_PX),
    )
    least = _least_share((2 * _RADIUS_PX + 1) ** 2 * max(views - 1, 1))
    return signal < np.float32(least) * every


def has_coarse_texture(grey: Map, scales: Scales, *, is_row: bool) -> NDArray[np.bool_]:
    """Whether the picture of half the size shows more than noise in the same patch, (H, W).

    Two views compare each pixel but once. A faint structure wider than a few pixels is no more than
    noise in the steps from pixel to pixel, and clear in wider ones: the search, which sums along
    paths, goes by it.

    Args:
        grey: (H, W) reference view before the prefilter.
        scales: grey scales of the images.
        is_row: whether the views stand in a row, and not in a column.
    """
    small = shrink(grey[None], _SHRINK)[0]
    if min(small.shape) < 2:
        return np.zeros(grey.shape, np.bool_)
    tilt = cv2.Sobel(small, cv2.CV_32F, int(is_row), int(not is_row), ksize=1, scale=0.5)
    radius_px = _RADIUS_PX // _SHRINK
    power = mean(np.square(np.asarray(tilt, np.float32)), radius_px)
    # Noise that is alike in neighbours is hardly less in their mean.
    noise = max(scales.shrunk_noise, scales.noise / _SHRINK)
    least = _least_share((2 * radius_px + 1) ** 2)
    told = power * np.float32(1.0 - least) > np.float32(0.5 * noise**2)
    return grow(told.astype(np.float32), _SHRINK, (grey.shape[0], grey.shape[1])) > 0


def _least_share(squares: float) -> float:
    """Share of the power of a patch that must be more than noise's."""
    chance = _CHANCE_SIGMAS * (2.0 * _ALIKE_PX / squares) ** 0.5
    return chance / (1.0 + chance)
