"""Pictures brought into the common frame quickly: for people and clouds, not for slopes."""

from typing import cast

import cv2
import numpy as np

from rig.arrays import Float
from rig.errors import SlopeError
from rig.optics.optics import Pixels


class QuickRemap:
    """Brings the pictures of one view into the common frame, linear between pixels.

    OpenCV rounds places to 1/32 px. A pixel without source repeats the nearest border, as that of
    rectified views does.

    Args:
        raw_px: (H, W, 2) raw pixel (x, y) of every rectified pixel; NaN for none.
        raw_shape: height and width of the raw pictures.
    """

    def __init__(self, raw_px: Float, raw_shape: tuple[int, int]) -> None:
        self._shape = raw_shape
        # OpenCV keeps whole pixels in 16 bits: what lies far outside would come in again.
        height, width = raw_shape
        inside = np.clip(np.nan_to_num(raw_px, nan=-1.0), -1.0, [width, height]).astype(np.float32)
        self._whole, self._parts = cv2.convertMaps(inside[..., 0], inside[..., 1], cv2.CV_16SC2)

    def __call__(self, image: Pixels) -> Pixels:
        """Return the picture, (H, W) or (H, W, 3), in the type that it came in.

        Raises:
            SlopeError: it has another size than the camera of the calibration.
        """
        if image.shape[:2] != self._shape:
            found, wanted = (f"{shape[1]} x {shape[0]} px" for shape in (image.shape, self._shape))
            raise SlopeError(
                f"a picture of {found} given, the calibration is of {wanted}",
                advice="calibrate at the size that is captured",
            )
        moved = cv2.remap(
            image, self._whole, self._parts, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        return cast("Pixels", moved)
