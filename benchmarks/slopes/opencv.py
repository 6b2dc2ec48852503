"""OpenCV's semi-global matchers on the widest pair of the same frames, turned into slopes."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar import RectifiedViews

MODES = {"HH": cv2.STEREO_SGBM_MODE_HH, "3WAY": cv2.STEREO_SGBM_MODE_SGBM_3WAY}
_BLOCK_PX = 3


def pair_slopes(
    views: RectifiedViews, range_px: tuple[float, float], mode: str
) -> NDArray[np.float32]:
    """Slopes (H, W) from the reference and the view farthest along the row (or the column).

    Pixels that the matcher leaves out take the lower of the next answers on either side.
    """
    along_row = bool(np.abs(views.x_steps).max() > 0.5)
    steps = views.x_steps if along_row else views.y_steps
    off_axis = np.abs(views.y_steps if along_row else views.x_steps) > 0.05
    other = int(np.argmax(np.where(off_axis, -np.inf, steps)))
    left, right = views.images[views.reference], views.images[other]
    if not along_row:
        left, right = left.T, right.T
    step = float(steps[other])
    first = int(np.floor(range_px[0] * step))
    count = int(np.ceil((range_px[1] * step - first) / 16)) * 16
    pad = max(0, first + count), max(0, -first)
    left, right = (
        cv2.copyMakeBorder(np.ascontiguousarray(i), 0, 0, *pad, cv2.BORDER_REPLICATE)
        for i in (left, right)
    )
    matcher = cv2.StereoSGBM.create(
        first,
        count,
        _BLOCK_PX,
        P1=8 * _BLOCK_PX**2,
        P2=32 * _BLOCK_PX**2,
        disp12MaxDiff=1,
        uniquenessRatio=5,
        speckleWindowSize=50,
        speckleRange=2,
        mode=MODES[mode],
    )
    disparity = matcher.compute(left, right)[:, pad[0] : left.shape[1] - pad[1]] / np.float32(16)
    filled = _fill(np.where(disparity < first, np.float32(np.nan), disparity))
    slope = (filled / np.float32(step)).astype(np.float32)
    return slope if along_row else np.ascontiguousarray(slope.T)


def _fill(disparity: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fill holes from the farther of the neighbours in the row."""
    sides: list[NDArray[np.float32]] = []
    for image in (disparity, disparity[:, ::-1]):
        known = np.isfinite(image)
        index = np.maximum.accumulate(np.where(known, np.arange(image.shape[1]), 0), axis=1)
        sides.append(np.take_along_axis(image, index, axis=1))
    return np.fmin(sides[0], sides[1][:, ::-1])
