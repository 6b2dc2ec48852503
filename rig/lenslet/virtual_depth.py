"""Slopes as virtual depth: how far behind the lenslets the main lens's image lies."""

import math

import numpy as np
from numpy.typing import NDArray

from rig.lenslet.lattice import Lattice

_COLUMN_SPACINGS = {"hexagonal": math.sqrt(0.75), "square": 1.0}


def virtual_depth(
    slope_px: NDArray[np.float32], lattice: Lattice, step_px: float
) -> NDArray[np.float32]:
    """Return virtual depths v of slopes: 0 where the image lies on the lenslets.

    The virtual depth is the distance of the image from the lenslets over that of the sensor from
    them (C. Perwass and L. Wietzke, "Single lens 3D-camera with extended depth-of-field", SPIE
    2012). From one micro-image to the next a point moves by `spacing / v`.

    Args:
        slope_px: px of a view per view step; NaN stays NaN.
        lattice: of the micro-images.
        step_px: between views one step apart, inside a micro-image.
    """
    per_slope = _COLUMN_SPACINGS[lattice.kind] * lattice.spacing_px / step_px
    return slope_px * np.float32(per_slope)
