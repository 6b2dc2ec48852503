"""Pictures behind a mosaic of colour filters (Bayer), as grey and in colour."""

from typing import Final

import cv2
import numpy as np

from rig.frames import ColourImage, GreyImage

_CODES: Final = {
    "BGGR": cv2.COLOR_BayerBGGR2RGB,
    "GBRG": cv2.COLOR_BayerGBRG2RGB,
    "GRBG": cv2.COLOR_BayerGRBG2RGB,
    "RGGB": cv2.COLOR_BayerRGGB2RGB,
}
ORDERS: Final = tuple(_CODES)
"""By the colours of the first two pixels of the first two lines."""
LEAST_GREY_PX: Final = 2
"""Shortest side of a mosaic that has all colours."""
LEAST_COLOUR_PX: Final = 3
"""Shortest side of a mosaic with colours between others."""


def grey_of_mosaic(mosaic: GreyImage) -> GreyImage:
    """Return a mosaic as grey: (red + 2 green + blue) / 4, rounded, in the sensor's counts.

    Every pixel is weighed with its eight neighbours: 4 for itself, 2 along rows and columns, 1
    along diagonals. Wherever the middle lies, the sixteenths come to 4 of red, 8 of green and 4
    of blue, so that the order of the colours does not matter, no colour is interpolated, and
    nothing is shifted.

    Args:
        mosaic: (H, W), both at least `LEAST_GREY_PX`.
    """
    weights = np.array([1.0, 2.0, 1.0])
    sums = cv2.sepFilter2D(  # mirrored at the border pixel: the colours stay in order
        mosaic, cv2.CV_32F, weights, weights, borderType=cv2.BORDER_REFLECT_101
    )
    rounded = (sums + 8.0) / 16.0
    return rounded.astype(np.uint8) if mosaic.dtype == np.uint8 else rounded.astype(np.uint16)


def colour_of_mosaic(mosaic: GreyImage, order: str, *, bits: int) -> ColourImage:
    """Return a mosaic in colour, (H, W, 3), bilinear; the upper eight bits of each value.

    Args:
        mosaic: (H, W), both at least `LEAST_COLOUR_PX`.
        order: one of `ORDERS`.
        bits: of a value, 8 or more.
    """
    whole = np.asarray(cv2.cvtColor(mosaic, _CODES[order]), mosaic.dtype)
    return (whole >> (bits - 8)).astype(np.uint8)
