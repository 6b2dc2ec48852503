"""From the bytes of a buffer to a grey image, for every pixel format that rig reads."""

from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.frames import GreyImage
from rig_drivers.mosaic import LEAST_GREY_PX, grey_of_mosaic

Bytes = NDArray[np.uint8]
Decoder = Callable[[Bytes, int, int, int], GreyImage]


class PixelError(ValueError):
    """The bytes are no image of the format and size agreed upon."""


class DoubtfulPixelError(PixelError):
    """The picture looks damaged; where the next one does at the same place, it is the scene.

    Args:
        message: what is wrong.
        place: where in the picture.
        image: the picture as it is.
    """

    def __init__(self, message: str, *, place: int, image: GreyImage) -> None:
        super().__init__(message)
        self.place = place
        self.image = image


def _grey8(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _rows(data, width_px, height_px, stride).copy()


def _grey16(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    rows = _rows(data, 2 * width_px, height_px, stride)
    return np.ascontiguousarray(rows).view("<u2").astype(np.uint16, copy=True)


def _luma_of_yuyv(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _rows(data, 2 * width_px, height_px, stride)[:, ::2].copy()


def _luma_of_uyvy(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _rows(data, 2 * width_px, height_px, stride)[:, 1::2].copy()


def _luma_of_rgb(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _luma(data, width_px, height_px, stride, cv2.COLOR_RGB2GRAY)


def _luma_of_bgr(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    return _luma(data, width_px, height_px, stride, cv2.COLOR_BGR2GRAY)


def _luma(data: Bytes, width_px: int, height_px: int, stride: int, code: int) -> GreyImage:
    pixels = _rows(data, 3 * width_px, height_px, stride).reshape(height_px, width_px, 3)
    return np.asarray(cv2.cvtColor(pixels, code), np.uint8)


def _grey10_packed(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    """Four pixels in five bytes: the upper eight bits of each, then two lower bits of all."""
    groups = -(-width_px // 4)
    packed = _rows(data, 5 * groups, height_px, stride).reshape(height_px, groups, 5)
    high = packed[..., :4].astype(np.uint16) << 2
    low = packed[..., 4:] >> np.array([0, 2, 4, 6], np.uint8) & 3
    return (high | low).astype(np.uint16).reshape(height_px, -1)[:, :width_px].copy()


def _grey12_packed(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    """Two pixels in three bytes: the upper eight bits of each, then four lower bits of both."""
    groups = -(-width_px // 2)
    packed = _rows(data, 3 * groups, height_px, stride).reshape(height_px, groups, 3)
    high = packed[..., :2].astype(np.uint16) << 4
    low = packed[..., 2:] >> np.array([0, 4], np.uint8) & 15
    return (high | low).astype(np.uint16).reshape(height_px, -1)[:, :width_px].copy()


def _grey8_in_turn(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    """A pixel of the left view, the same pixel of the right one, and so on: twice as wide."""
    return _grey8(data, 2 * width_px, height_px, stride)


def _grey12_in_turn(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    """The same with both pixels in three bytes: the lower twelve bits are the left one's."""
    packed = _rows(data, 3 * width_px, height_px, stride).reshape(height_px, width_px, 3)
    low, middle, high = (packed[..., byte].astype(np.uint16) for byte in range(3))
    pixels = np.stack([low | (middle & 15) << 8, middle >> 4 | high << 4], axis=-1)
    return pixels.astype(np.uint16).reshape(height_px, 2 * width_px)


def _of_bayer(decode: Decoder) -> Decoder:
    """Return what reads a mosaic of colours as grey."""

    def grey(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
        mosaic = decode(data, width_px, height_px, stride)
        if min(mosaic.shape) < LEAST_GREY_PX:
            raise PixelError(f"{width_px} x {height_px} px are no mosaic of colours")
        return grey_of_mosaic(mosaic)

    return grey


def _jpeg(data: Bytes, width_px: int, height_px: int, stride: int) -> GreyImage:
    del stride  # compressed
    from rig_drivers.jpeg import (
        grey as jpeg,  # compiles machine code, which only these cameras need
    )

    try:
        return jpeg.grey_of_jpeg(data, width_px=width_px, height_px=height_px)
    except jpeg.ShiftedPictureError as error:
        raise DoubtfulPixelError(str(error), place=error.unit, image=error.image) from error
    except jpeg.JpegDamageError as error:
        raise PixelError(str(error)) from error


DECODERS: Final[dict[str, tuple[Decoder, int]]] = {
    "GREY": (_grey8, 8),
    "Y10": (_grey16, 10),
    "Y12": (_grey16, 12),
    "Y16": (_grey16, 16),
    "Y10P": (_grey10_packed, 10),
    "Y12P": (_grey12_packed, 12),
    "Y14": (_grey16, 14),
    **dict.fromkeys(("YUYV", "YVYU"), (_luma_of_yuyv, 8)),
    **dict.fromkeys(("UYVY", "VYUY"), (_luma_of_uyvy, 8)),
    # A plane of luma comes first; whatever planes of colour follow, grey has no use for them.
    **dict.fromkeys(("NV12", "NV21", "NV16", "NV61", "YU12", "YV12"), (_grey8, 8)),
    "RGB3": (_luma_of_rgb, 8),
    "BGR3": (_luma_of_bgr, 8),
    **dict.fromkeys(("MJPG", "JPEG"), (_jpeg, 8)),
    "Y8I": (_grey8_in_turn, 8),
    "Y12I": (_grey12_in_turn, 12),
    **dict.fromkeys(("BA81", "GBRG", "GRBG", "RGGB"), (_of_bayer(_grey8), 8)),
    **dict.fromkeys(("BG10", "GB10", "BA10", "RG10"), (_of_bayer(_grey16), 10)),
    **dict.fromkeys(("BG12", "GB12", "BA12", "RG12"), (_of_bayer(_grey16), 12)),
    **dict.fromkeys(("BG14", "GB14", "GR14", "RG14"), (_of_bayer(_grey16), 14)),
    **dict.fromkeys(("BYR2", "GB16", "GR16", "RG16"), (_of_bayer(_grey16), 16)),
    **dict.fromkeys(("pBAA", "pGAA", "pgAA", "pRAA"), (_of_bayer(_grey10_packed), 10)),
    **dict.fromkeys(("pBCC", "pGCC", "pgCC", "pRCC"), (_of_bayer(_grey12_packed), 12)),
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
        DoubtfulPixelError: a picture that may be damaged.
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
