"""From the bytes of a buffer to a grey image, for every pixel format that rig reads."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.frames import GreyImage

Bytes = NDArray[np.uint8]


class PixelError(ValueError):
    """The bytes are no image of the format and size agreed upon."""


def _grey8(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _rows(data, width_px, height_px, stride).copy()


def _grey16(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    rows = _rows(data, 2 * width_px, height_px, stride)
    return np.ascontiguousarray(rows).view("<u2").astype(np.uint16, copy=True)


def _luma_of_yuyv(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _rows(data, 2 * width_px, height_px, stride)[:, ::2].copy()


def _jpeg(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    del stride  # compressed
    from rig_drivers.v4l2 import jpeg  # compiles machine code, which only these cameras need

    try:
        return jpeg.grey_of_jpeg(data, width_px=width_px, height_px=height_px)
    except jpeg.JpegDamage as error:
        raise PixelError(str(error)) from error


Decoder = Callable[[Bytes, int, int, int], GreyImage]

DECODERS: Final[dict[str, tuple[Decoder, int]]] = {
    "GREY": (_grey8, 8),
    "Y10": (_grey16, 10),
    "Y12": (_grey16, 12),
    "Y16": (_grey16, 16),
    "YUYV": (_luma_of_yuyv, 8),
    "NV12": (_grey8, 8),
    "MJPG": (_jpeg, 8),
}
"""By pixel format: what reads it, and how many bits a grey value has.

Values stay as the sensor counted them: Y10 gives 0..1023 and Y12 0..4095 in 16-bit images, not
scaled to the full range, so that noise and saturation keep their meaning. `Frame.bits` tells."""


def to_grey(
    data: Bytes, pixel_format: str, *, width_px: int, height_px: int, bytes_per_line: int
) -> GreyImage:
    """Turn the used bytes of a buffer into an image of its own, (H, W).

    Args:
        data: the bytes that the driver says it filled.
        pixel_format: a key of `DECODERS`.
        width_px: width agreed upon.
        height_px: height agreed upon.
        bytes_per_line: from the start of a line to the start of the next; of the luma plane in
            planar formats; without meaning in compressed ones.

    Raises:
        PixelError: too few bytes, or a damaged picture.
    """
    decode, _ = DECODERS[pixel_format]
    return decode(data, width_px, height_px, bytes_per_line)


def _rows(data: Bytes, used: int, height_px: int, stride: int) -> Bytes:
    """Return the used bytes of every line, (H, used); the last line may end early."""
    needed = (height_px - 1) * stride + used
    if stride < used or data.size < needed:
        raise PixelError(
            f"{data.size} bytes, {needed} needed for {height_px} lines of {stride} bytes"
        )
    return np.lib.stride_tricks.as_strided(
        data, shape=(height_px, used), strides=(stride, 1), writeable=False
    )
