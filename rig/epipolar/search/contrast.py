"""What the coarse search compares: grey values in which fine texture counts for more than light.

Light that differs between cameras is smooth, texture is not. The derivative along the line of a
view shows texture without the light (the Sobel prefilter of H. Hirschmuller and S. Gehrig, "Stereo
matching in the presence of sub-pixel calibration errors", CVPR 2009); a part of the grey value
itself keeps surfaces apart that have none.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.compute.bands import run_in_bands
from rig.epipolar.search.halves import is_beside
from rig.epipolar.search.window import Cameras

Map = NDArray[np.float32]

_LIGHT_SHARE = np.float32(0.15)
_ALONG = np.array([[-0.5, 0.0, 0.5]], np.float32)
"""Central difference."""


def raise_texture(images: Map, cameras: Cameras) -> tuple[Map, Map]:
    """Bring out the texture of every view along the axis of its half.

    Args:
        images: (V, H, W) grey values.
        cameras: where the views stand.

    Returns:
        Views (V, H, W); and the reference as views of the row and of the column see it, (2, H, W).
    """
    beside = is_beside(cameras.x_steps, cameras.y_steps)
    raised = np.empty_like(images)

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            raised[i] = _raised(images[i], is_column=not beside[i])

    run_in_bands(work, len(images))
    centre = images[cameras.reference]
    return raised, np.stack([_raised(centre, is_column=False), _raised(centre, is_column=True)])


def texture_levels(centres: Map) -> float:
    """Root mean square of what `raise_texture` makes of a reference, light taken off."""
    rough = [cv2.Laplacian(centre, cv2.CV_32F) for centre in centres]
    return float(np.sqrt(np.mean([np.mean(one * one) for one in rough])))


def _raised(image: Map, *, is_column: bool) -> Map:
    taps = _ALONG.T if is_column else _ALONG
    steep = cv2.filter2D(image, cv2.CV_32F, taps, borderType=cv2.BORDER_REPLICATE)
    return steep + _LIGHT_SHARE * image
