"""From the bytes of a buffer to a picture in colour, for every pixel format that has colour.

For people, for clouds, and for estimators that ask for it: boards are measured in the grey picture,
which is read apart (`rig_drivers.v4l2.pixels`) and stays what it is.
"""

from collections.abc import Callable
from typing import Final

import cv2
import numpy as np

from rig.frames import ColourImage
from rig_drivers.mosaic import LEAST_COLOUR_PX, colour_of_mosaic
from rig_drivers.v4l2.pixels import DECODERS, Bytes, PixelError, to_grey

_Reader = Callable[[Bytes, int, int, int], ColourImage | None]
_END_MARK: Final = np.array([0xFF, 0xD9], np.uint8)


def _of_pairs(code: int) -> _Reader:
    """Two pixels share their colour (YUV 4:2:2); matrix and range of BT.601, as webcams have it."""

    def colour(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
        lines = _lines(data, 2 * width_px, height_px, stride)
        if width_px % 2:
            raise PixelError(f"{width_px} px are no pairs of pixels")
        return np.asarray(cv2.cvtColor(lines.reshape(height_px, width_px, 2), code), np.uint8)

    return colour


def _vyuy(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
    """As UYVY, with the two colours in the other order."""
    fours = _lines(data, 2 * width_px, height_px, stride)
    if width_px % 2:
        raise PixelError(f"{width_px} px are no pairs of pixels")
    swapped = fours.reshape(height_px, width_px // 2, 4)[..., [2, 1, 0, 3]]
    pairs = swapped.reshape(height_px, width_px, 2)
    return np.asarray(cv2.cvtColor(pairs, cv2.COLOR_YUV2RGB_UYVY), np.uint8)


def _of_two_planes(code: int) -> _Reader:
    """The plane of luma, and behind it half as many lines of both colours in turn."""

    def colour(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
        _require_squares(width_px, height_px)
        lines = _lines(data, width_px, height_px + height_px // 2, stride)
        return np.asarray(cv2.cvtColor(lines, code), np.uint8)

    return colour


def _of_whole_planes(code: int) -> _Reader:
    """The plane of luma, and behind it as many lines of both colours in turn."""

    def colour(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
        if width_px % 2:
            raise PixelError(f"{width_px} px are no pairs of pixels")
        lines = _lines(data, width_px, 2 * height_px, stride)
        pairs = np.dstack([lines[:height_px], lines[height_px:]])
        return np.asarray(cv2.cvtColor(pairs, code), np.uint8)

    return colour


def _of_three_planes(code: int) -> _Reader:
    """The plane of luma, and behind it two small ones, whose lines are half as long."""

    def colour(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
        _require_squares(width_px, height_px)
        luma = _lines(data, width_px, height_px, stride)
        small = _lines(data[stride * height_px :], width_px // 2, height_px, stride // 2)
        planes = np.concatenate([luma, small.reshape(height_px // 2, width_px)])
        return np.asarray(cv2.cvtColor(planes, code), np.uint8)

    return colour


def _require_squares(width_px: int, height_px: int) -> None:
    if width_px % 2 or height_px % 2:
        raise PixelError(f"{width_px} x {height_px} px are no squares of four pixels")


def _rgb(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
    return _lines(data, 3 * width_px, height_px, stride).reshape(height_px, width_px, 3)


def _bgr(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
    return np.ascontiguousarray(_rgb(data, width_px, height_px, stride)[..., ::-1])


def _of_mosaic(grey_format: str, order: str) -> _Reader:
    """Colours between the pixels of a mosaic, bilinear; the upper eight bits of each."""

    def colour(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage:
        mosaic = to_grey(
            data, grey_format, width_px=width_px, height_px=height_px, bytes_per_line=stride
        )
        if min(mosaic.shape) < LEAST_COLOUR_PX:
            raise PixelError(f"{width_px} x {height_px} px are too few to tell colours between")
        return colour_of_mosaic(mosaic, order, bits=DECODERS[grey_format][1])

    return colour


def _jpeg(data: Bytes, width_px: int, height_px: int, stride: int) -> ColourImage | None:
    """None for a picture that is grey itself."""
    del stride  # compressed
    from rig_drivers.jpeg.header import JpegDamageError, read_header  # compiles machine code

    try:
        is_grey = len(read_header(data.tobytes()).components) < 3
    except JpegDamageError as error:
        raise PixelError(str(error)) from error
    if is_grey:
        return None
    read = cv2.imdecode(np.concatenate([data, _END_MARK]), cv2.IMREAD_COLOR_RGB)
    if read is None or read.shape != (height_px, width_px, 3):
        raise PixelError("nothing that the decoder can read in colour")
    return np.asarray(read, np.uint8)


_ORDERS: Final = {
    "BGGR": ("BA81", "BG10", "BG12", "BG14", "BYR2", "pBAA", "pBCC"),
    "GBRG": ("GBRG", "GB10", "GB12", "GB14", "GB16", "pGAA", "pGCC"),
    "GRBG": ("GRBG", "BA10", "BA12", "GR14", "GR16", "pgAA", "pgCC"),
    "RGGB": ("RGGB", "RG10", "RG12", "RG14", "RG16", "pRAA", "pRCC"),
}
"""By the colours of the first two pixels of the first two lines: the kernel's names for it, with
8, 10, 12, 14 and 16 bits in whole bytes, and with 10 and 12 bits packed."""
_AS_GREY: Final = ("GREY", "Y10", "Y12", "Y14", "Y16", "Y10P", "Y12P")

COLOUR_READERS: Final[dict[str, _Reader]] = {
    "YUYV": _of_pairs(cv2.COLOR_YUV2RGB_YUYV),
    "YVYU": _of_pairs(cv2.COLOR_YUV2RGB_YVYU),
    "UYVY": _of_pairs(cv2.COLOR_YUV2RGB_UYVY),
    "VYUY": _vyuy,
    "NV12": _of_two_planes(cv2.COLOR_YUV2RGB_NV12),
    "NV21": _of_two_planes(cv2.COLOR_YUV2RGB_NV21),
    "NV16": _of_whole_planes(cv2.COLOR_YUV2RGB_YUYV),
    "NV61": _of_whole_planes(cv2.COLOR_YUV2RGB_YVYU),
    "YU12": _of_three_planes(cv2.COLOR_YUV2RGB_I420),
    "YV12": _of_three_planes(cv2.COLOR_YUV2RGB_YV12),
    "MJPG": _jpeg,
    "JPEG": _jpeg,
    "RGB3": _rgb,
    "BGR3": _bgr,
    **{
        name: _of_mosaic(grey_format, order)
        for order, names in _ORDERS.items()
        for name, grey_format in zip(names, _AS_GREY, strict=True)
    },
}
"""By pixel format; what is not here has no colour."""


def to_colour(
    data: Bytes, pixel_format: str, *, width_px: int, height_px: int, bytes_per_line: int
) -> ColourImage | None:
    """Turn the used bytes of a buffer into a picture in colour, (H, W, 3); None where it has none.

    Args:
        data: the bytes that the driver says it filled, of which `to_grey` made a picture.
        pixel_format: a key of `DECODERS`.
        width_px: width agreed upon.
        height_px: height agreed upon.
        bytes_per_line: see `to_grey`.

    Raises:
        PixelError: too few bytes, or a size that the format cannot have.
    """
    read = COLOUR_READERS.get(pixel_format)
    return None if read is None else read(data, width_px, height_px, bytes_per_line)


def _lines(data: Bytes, used: int, height_px: int, stride: int) -> Bytes:
    """Return the used bytes of every line, (H, used), in memory of their own."""
    lines = to_grey(data, "GREY", width_px=used, height_px=height_px, bytes_per_line=stride)
    return np.asarray(lines, np.uint8)
