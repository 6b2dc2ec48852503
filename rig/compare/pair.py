"""The best stereo pair of a multi-view, laid out as stereo matchers want it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews
from rig.epipolar.views import Image
from rig.errors import SlopeError

Span = tuple[float, float]
DISPARITY_BLOCK = 16
"""OpenCV searches a multiple of so many disparities."""
_OFF_AXIS = 0.01
"""A pair needs common rows or columns; part of its baseline that it may be off them."""


@dataclass(frozen=True, slots=True)
class Pair:
    """The reference view and one other, turned so that the reference is the left image.

    Then a point at column u of `left` is at column u - d of `right`, and its slope is d divided by
    the baseline. A column of views is transposed first; a partner to the left is mirrored.
    """

    left: NDArray[np.uint8]
    """(H, W) of the reference view, or (W, H) where it is transposed."""
    right: NDArray[np.uint8]
    partner: int
    """Index of the other view."""
    baseline_steps: float
    """Distance of the two views in view steps; above 0."""
    is_transposed: bool
    is_mirrored: bool

    def disparities(self, slope_range_px: Span) -> tuple[int, int]:
        """Return the first disparity and how many, a multiple of 16, cover a range of slopes.

        What the multiple adds is shared between both ends.
        """
        low, high = (slope * self.baseline_steps for slope in slope_range_px)
        first, needed = math.floor(low), math.ceil(high) - math.floor(low) + 1
        count = DISPARITY_BLOCK * math.ceil(needed / DISPARITY_BLOCK)
        return first - (count - needed) // 2, count

    def slope_px(self, disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Turn disparities of `left` into slopes of the reference view.

        Args:
            disparity_px: Shape of `left`, NaN for no answer.

        Returns:
            (H, W) px per view step, NaN for no answer.
        """
        slope_px = disparity_px / np.float32(self.baseline_steps)
        slope_px = slope_px[:, ::-1] if self.is_mirrored else slope_px
        return np.ascontiguousarray(slope_px.T if self.is_transposed else slope_px)


def best_pair(views: RectifiedViews) -> Pair:
    """Join the reference view with the farthest view in its row or column.

    Images that are not 8 bit are stretched to 0..255, both alike.

    Raises:
        SlopeError: no other view lies in the row or the column of the reference.
    """
    along = np.where(np.abs(views.x_steps) >= np.abs(views.y_steps), views.x_steps, views.y_steps)
    off = np.minimum(np.abs(views.x_steps), np.abs(views.y_steps))
    baseline = np.where(off <= _OFF_AXIS * np.abs(along), np.abs(along), 0.0)
    partner = int(np.argmax(baseline))
    if baseline[partner] == 0.0:
        raise SlopeError(
            f"asked for a stereo pair, none of {len(baseline) - 1} views lies in the row or column "
            "of the reference view",
            advice="compare with a rig that has one there",
        )
    left, right = _eight_bit(views.images[views.reference], views.images[partner])
    is_transposed = bool(abs(views.y_steps[partner]) > abs(views.x_steps[partner]))
    is_mirrored = bool(along[partner] < 0.0)
    if is_transposed:
        left, right = left.T, right.T
    if is_mirrored:
        left, right = left[:, ::-1], right[:, ::-1]
    return Pair(
        left=np.ascontiguousarray(left),
        right=np.ascontiguousarray(right),
        partner=partner,
        baseline_steps=float(baseline[partner]),
        is_transposed=is_transposed,
        is_mirrored=is_mirrored,
    )


def _eight_bit(left: Image, right: Image) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    if left.dtype == np.uint8:
        return np.asarray(left, np.uint8), np.asarray(right, np.uint8)
    low = min(float(left.min()), float(right.min()))
    gain = 255.0 / max(float(left.max()) - low, float(right.max()) - low, 1e-12)

    def stretched(image: Image) -> NDArray[np.uint8]:
        return np.rint((image.astype(np.float32) - low) * gain).astype(np.uint8)

    return stretched(left), stretched(right)
