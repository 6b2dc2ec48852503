"""Features of raw pictures, matched between the reference and every other view.

D. G. Lowe, "Distinctive image features from scale-invariant keypoints" (IJCV 60, 2004): they are
found again whatever size, way up or light the other picture has, so nothing need be known of the
cameras. Good to about half a pixel: `rig.epipolar.scene.fine` measures them to a twentieth.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float, Index
from rig.epipolar.scene.features import SceneFeatures

_MOST = 4000
"""Features of one picture."""
_CONTRAST = 0.01
"""Least contrast of a feature, of the full scale: a quarter of the usual, walls have little."""
_CLEARER = 0.8
"""The best match must be nearer than this part of the distance to the second best (Lowe, 7.1)."""
_COARSE_PX = 0.5
_BYTES = 255.0


class _Found(NamedTuple):
    """Features of one picture."""

    xy_px: Float
    """(N, 2)."""
    looks: NDArray[np.float32]
    """(N, 128)."""


def match_features(
    images: Sequence[NDArray[np.generic]], reference: int, picture: int, full_scale: int
) -> SceneFeatures:
    """Find the features that the reference shares with other views.

    Args:
        images: of each view, (H, W) grey; any sizes.
        reference: index of the reference view.
        picture: number of the multi-view.
        full_scale: largest grey value.

    Returns:
        Matches that are best both ways and clearly better than the second best; wrong ones are
        among them still.
    """
    found = [_features(image, full_scale) for image in images]
    own = found[reference]
    view_px = np.full((len(own.xy_px), len(images), 2), np.nan)
    for view, other in enumerate(found):
        if view != reference:
            mine, theirs = _pairs(own.looks, other.looks)
            view_px[mine, view] = other.xy_px[theirs]
    everywhere = SceneFeatures(
        np.full(len(own.xy_px), picture),
        own.xy_px,
        view_px,
        np.full(view_px.shape[:2], _COARSE_PX),
    )
    return everywhere[everywhere.shared]


def _features(image: NDArray[np.generic], full_scale: int) -> _Found:
    grey = np.clip(np.rint(image.astype(np.float64) * (_BYTES / full_scale)), 0.0, _BYTES).astype(
        np.uint8
    )
    finder = cv2.SIFT.create(nfeatures=_MOST, contrastThreshold=_CONTRAST)
    points, looks = finder.detectAndCompute(grey, np.full_like(grey, 255))
    if not points:
        return _Found(np.zeros((0, 2)), np.zeros((0, 128), np.float32))
    xy_px = np.array([point.pt for point in points], np.float64)
    # A place whose texture runs two ways is a feature twice.
    _, first = np.unique(np.round(xy_px, 2), axis=0, return_index=True)
    kept = np.sort(first)
    return _Found(xy_px[kept], np.asarray(looks, np.float32)[kept])


def _pairs(left: NDArray[np.float32], right: NDArray[np.float32]) -> tuple[Index, Index]:
    """Rows of both (N,) that are each other's best match, and clearly so."""
    if len(left) < 2 or len(right) < 2:
        nothing = np.zeros(0, np.int64)
        return nothing, nothing
    likeness = left @ right.T
    power = np.square(left).sum(axis=1)[:, None] + np.square(right).sum(axis=1)
    distance2 = np.maximum(power - 2.0 * likeness, 0.0)
    best, back = distance2.argmin(axis=1), distance2.argmin(axis=0)
    rows = np.arange(len(left))
    nearest = distance2[rows, best]
    second = np.partition(distance2, 1, axis=1)[:, 1]
    kept = (back[best] == rows) & (nearest < _CLEARER**2 * second)
    return rows[kept], best[kept].astype(np.int64)
