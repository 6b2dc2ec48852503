"""Which features stood still while the views were exposed one after the other.

What moves at v px/s lies v t px elsewhere in a view that is exposed t s later, and across the lines
that looks as if the view had turned. Two pictures of the reference, one shortly after the other,
tell how fast each feature moves (B. D. Lucas and T. Kanade, "An iterative image registration
technique with an application to stereo vision", IJCAI 1981).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Flags, Float

ROWS_PX = 0.02
"""Rows may be off by so much because something moved: well below the drift that is looked for."""
_TOLD_PX = 0.1
"""Motion between two pictures is told from none from here on."""
_FASTEST_PX = 20.0
"""Motion that is not followed: what moves faster is blurred in the picture."""
_WINDOW_PX = (15, 15)
_BYTES = 255.0


@dataclass(frozen=True, slots=True)
class Before:
    """What the reference showed shortly before."""

    image: NDArray[np.generic]
    """(H, W) grey."""
    allowed_px: float
    """How far a feature may have moved since."""


def before(image: NDArray[np.generic], passed_s: float, skew_s: float) -> Before | None:
    """Return how far features may have moved since an earlier picture.

    Args:
        image: (H, W) of the reference.
        passed_s: since then, until the picture that is looked at.
        skew_s: between the first and the last view of that.

    Returns:
        None where no motion that leaves pictures sharp matters.
    """
    allowed_px = ROWS_PX * passed_s / skew_s if skew_s > 0.0 else np.inf
    return None if allowed_px > _FASTEST_PX else Before(image, max(allowed_px, _TOLD_PX))


def standing(
    earlier: Before, image: NDArray[np.generic], places_px: Float, full_scale: int
) -> Flags:
    """Return which features (N,) have hardly moved; those that are not found again have.

    Args:
        earlier: the picture before.
        image: (H, W) that the features were found in.
        places_px: (N, 2) of the features.
        full_scale: largest grey value.
    """
    if not len(places_px):
        return np.zeros(0, np.bool_)
    now, then = (_bytes(one, full_scale) for one in (image, earlier.image))
    points = np.asarray(places_px, np.float32).reshape(-1, 1, 2)
    found, is_found, _ = cv2.calcOpticalFlowPyrLK(
        now, then, points, np.empty_like(points), winSize=_WINDOW_PX, maxLevel=3
    )
    moved_px = np.linalg.norm((found - points).reshape(-1, 2), axis=1)
    return (is_found.ravel() > 0) & (moved_px <= earlier.allowed_px)


def _bytes(image: NDArray[np.generic], full_scale: int) -> NDArray[np.uint8]:
    scaled = image.astype(np.float64) * (_BYTES / full_scale)
    return np.clip(np.rint(scaled), 0.0, _BYTES).astype(np.uint8)
