"""Motion JPEG that can be trusted: a picture is whole, or it is refused with the reason."""

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import GreyImage
from rig_drivers.jpeg.header import JpegDamageError, read_header
from rig_drivers.jpeg.scan import walk_scan
from rig_drivers.jpeg.seams import shifted_from

__all__ = ["JpegDamageError", "ShiftedPictureError", "grey_of_jpeg"]


class ShiftedPictureError(JpegDamageError):
    """All codes are valid, but the brightness jumps as it does behind a damaged one.

    Args:
        unit: the number of the coded unit where it jumps. A scene that only looks so, looks so in
            the next picture too, and at the same unit.
        image: the picture as it is, (H, W) of 8 bits.
    """

    def __init__(self, unit: int, image: GreyImage) -> None:
        super().__init__(f"brightness jumps at unit {unit}, in the middle of the picture")
        self.unit = unit
        self.image = image


_END_MARK = b"\xff\xd9"


def grey_of_jpeg(data: NDArray[np.uint8], *, width_px: int, height_px: int) -> GreyImage:
    """Return the luma of a picture, (H, W) of 8 bits.

    The decoder would fill in what it cannot read; so every code is checked before, and the light
    of the decoded picture afterwards. What follows the end mark, bytes that only fill up, and a
    missing end mark behind a complete picture are harmless.

    Args:
        data: the bytes of a buffer, from the start mark on.
        width_px: width agreed upon.
        height_px: height agreed upon.

    Raises:
        ShiftedPictureError: it looks damaged, see there.
        JpegDamageError: the picture is damaged, of another size, or none.
    """
    header = read_header(data.tobytes())
    if (header.width_px, header.height_px) != (width_px, height_px):
        raise JpegDamageError(
            f"the JPEG picture holds {header.width_px} x {header.height_px} px, "
            f"agreed were {width_px} x {height_px} px"
        )
    end = walk_scan(data, header)
    whole = data[:end].tobytes() + _END_MARK
    image: NDArray[np.generic] | None = cv2.imdecode(
        np.frombuffer(whole, np.uint8), cv2.IMREAD_GRAYSCALE
    )
    if image is None or image.shape != (height_px, width_px):
        raise JpegDamageError("nothing that the decoder can read")
    grey = cast("GreyImage", image)
    unit = shifted_from(grey, unit_px=header.unit_px, units_per_restart=header.units_per_restart)
    if unit is not None:
        raise ShiftedPictureError(unit, grey)
    return grey
