"""Whether the corners of a board lie on smooth lines, straight or bent by a lens."""

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

_MAX_CURVE = 0.6
"""Change of step, in steps, that the widest lenses make from one square to the next."""


def smooth_triples(xy_px: Float, share: float, loose_px: float = 0.0) -> NDArray[np.bool_]:
    """Tell which three neighbours in a column lie on a smooth line.

    A line is smooth where its step changes by little, or by about as much as at the triple beside:
    a wide lens bends lines by a third of a step from one square to the next, but evenly.

    Args:
        xy_px: (R, C, 2) corners, NaN where there is none; R at least 3.
        share: what the step may change by, and what this change may change by, in steps.
        loose_px: what corners that are not refined add to that.

    Returns:
        (R - 2, C); triples with a missing corner count as smooth.
    """
    step = np.diff(xy_px, axis=0)
    length_px = np.linalg.norm(step, axis=-1)
    shorter_px = np.minimum(length_px[1:], length_px[:-1])
    bend = np.diff(step, axis=0)
    bend_px = np.linalg.norm(bend, axis=-1)
    smooth = ~(bend_px > share * shorter_px + loose_px)
    change_px = np.linalg.norm(np.diff(bend, axis=0), axis=-1)
    even = change_px <= share * np.minimum(shorter_px[1:], shorter_px[:-1]) + loose_px
    curved = bend_px <= _MAX_CURVE * shorter_px + loose_px
    even &= curved[1:] & curved[:-1]
    smooth[1:] |= even
    smooth[:-1] |= even
    return smooth
