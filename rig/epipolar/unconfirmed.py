"""What the other view of a pair leaves open, as a variance of the slopes.

Two readings of one slope, each with an error of its own, tell that error by their difference. Where
slopes jump beside what is not confirmed, paths make ramps and push edges: such a pixel may belong
to either surface, and is off by a part of the jump. And along a band that only one view sees, a
narrow strip of either surface is taken for the other now and then, without a jump to tell it.
"""

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.median import near_jumps
from rig.epipolar.rank import highest, lowest
from rig.epipolar.search.found import Found
from rig.epipolar.search.pair import LABELS_PX
from rig.epipolar.search.window import LABEL_SHIFT_PX, Cameras

Map = NDArray[np.float32]

_BESIDE_PX = 3
_BAND_PX = 1
"""What is not confirmed for less than three pixels either way is no band, but noise."""
_JUMP_SHARE, _BAND_SHARE, _READING_SHARE = np.float32(1 / 4), np.float32(1 / 16), np.float32(0.5)
"""Mean squared error over the squared jump, over that of the readings in the band beside (a tenth
to two fifths, and about a sixteenth, on real and rendered pairs), and over that of two readings."""


def is_confirmed(found: Found) -> NDArray[np.bool_]:
    """Pixels whose slopes, and whose neighbours' slopes, the other view shares, (H, W).

    Args:
        found: what the search of a pair found.
    """
    return highest(_is_open(found).astype(np.float32), _BESIDE_PX) == 0


def unconfirmed_variance(
    found: Found, slope_px: Map, against: NDArray[np.bool_], cameras: Cameras
) -> Map | None:
    """Variance of slopes by what the other view leaves open, (H, W); None for nothing.

    Args:
        found: what the search of a pair found.
        slope_px: (H, W) slopes as they are now.
        against: (H, W) where grey values contradict them.
        cameras: where the views stand.
    """
    is_open = _is_open(found)
    if not (is_open | against).any():
        return None
    beside = _beside(is_open, slope_px, cameras) | is_open | against
    jump_px = highest(slope_px, _BESIDE_PX) - lowest(slope_px, _BESIDE_PX)
    variance = np.where(beside, _JUMP_SHARE * np.square(jump_px), np.float32(0))
    band_px = highest(lowest(found.apart_px, _BAND_PX), _BAND_PX + _BESIDE_PX)
    variance += _BAND_SHARE * np.square(band_px)
    return variance + _READING_SHARE * np.square(found.apart_px)


def _is_open(found: Found) -> NDArray[np.bool_]:
    return found.unshared | (found.apart_px > 0)


def _beside(is_open: NDArray[np.bool_], slope_px: Map, cameras: Cameras) -> NDArray[np.bool_]:
    """Pixels at a jump beside these, (H, W).

    Less than a label of the search is no jump, but how its labels are told where texture is weak.
    """
    beside = highest(is_open.astype(np.float32), _BESIDE_PX) > 0
    return beside & near_jumps(slope_px, LABELS_PX / LABEL_SHIFT_PX * cameras.step_px, 1)
