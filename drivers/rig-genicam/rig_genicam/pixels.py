"""From the bytes of a buffer to a picture, for every pixel format of a profile.

Source of the layouts: GenICam Pixel Format Naming Convention (`...p`: bits in a row, the lowest
first) and GigE Vision (`...Packed`: the upper eight bits of two pixels around their lower ones).
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from rig_drivers.mosaic import (
    LEAST_COLOUR_PX,
    LEAST_GREY_PX,
    colour_of_mosaic,
    grey_of_mosaic,
)

from rig.frames import ColourImage, GreyImage

Bytes = NDArray[np.uint8]
_NAME: Final = re.compile(r"(Mono|Bayer(?:RG|GR|GB|BG)|RGB|BGR)(\d+)(p|Packed)?")
_ORDERS: Final = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}


class PixelError(ValueError):
    """The bytes are no picture of the format and size agreed upon."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How the values of a pixel format lie in memory."""

    colours: str
    """Order of a mosaic, see `rig_drivers.mosaic.ORDERS`; `RGB`, `BGR`, or empty: grey."""
    bits: int
    """Of a value."""
    packing: str
    """`p`, `Packed`, or empty: whole bytes."""

    @property
    def values_per_pixel(self) -> int:
        """Values of a pixel."""
        return 3 if self.colours in ("RGB", "BGR") else 1

    @property
    def pixel_bits(self) -> int:
        """Bits that a pixel takes in memory."""
        in_memory = {"p": self.bits, "Packed": 12}.get(self.packing, -(-self.bits // 8) * 8)
        return self.values_per_pixel * in_memory

    def size_bytes(self, pixels: int) -> int:
        """Return the bytes of so many pixels in a row."""
        return -(-pixels * self.pixel_bits // 8)


def layout_of(pixel_format: str) -> Layout:
    """Return how a pixel format lies in memory.

    Raises:
        PixelError: it is none that can be read.
    """
    named = _NAME.fullmatch(pixel_format)
    if named is None:
        raise PixelError(f"{pixel_format} cannot be read")
    family, bits, packing = named.group(1), int(named.group(2)), named.group(3) or ""
    if (packing, bits) not in _UNPACKED:
        raise PixelError(f"{pixel_format} cannot be read")
    colours = _ORDERS.get(family.removeprefix("Bayer"), "" if family == "Mono" else family)
    return Layout(colours, bits, packing)


def to_picture(
    data: Bytes,
    pixel_format: str,
    *,
    width_px: int,
    height_px: int,
    padding_bytes: int = 0,
    colour: bool = True,
) -> tuple[GreyImage, ColourImage | None]:
    """Return the picture in memory of its own: grey (H, W), and in colour where it has some.

    Args:
        data: the bytes of the picture, and perhaps chunks behind them.
        pixel_format: see `layout_of`.
        width_px: width agreed upon.
        height_px: height agreed upon.
        padding_bytes: behind every line.
        colour: whether colour is wanted.

    Raises:
        PixelError: fewer bytes than that, or too few pixels for a mosaic.
    """
    layout = layout_of(pixel_format)
    if padding_bytes:
        data = _without(padding_bytes, data, layout.size_bytes(width_px), height_px)
    needed = layout.size_bytes(width_px * height_px)
    if data.size < needed:
        raise PixelError(
            f"{data.size} bytes, {pixel_format} {width_px} x {height_px} px has {needed}"
        )
    count = width_px * height_px * layout.values_per_pixel
    values = _UNPACKED[layout.packing, layout.bits](data[:needed])[:count]
    if layout.values_per_pixel == 3:
        return _of_colours(values.reshape(height_px, width_px, 3), layout.colours, wanted=colour)
    picture = values.reshape(height_px, width_px)
    if not layout.colours:
        return picture, None
    if min(picture.shape) < (LEAST_COLOUR_PX if colour else LEAST_GREY_PX):
        raise PixelError(f"{width_px} x {height_px} px are no mosaic of colours")
    whole = colour_of_mosaic(picture, layout.colours, bits=layout.bits) if colour else None
    return grey_of_mosaic(picture), whole


def _without(padding_bytes: int, data: Bytes, used_bytes: int, lines: int) -> Bytes:
    needed = lines * (used_bytes + padding_bytes)
    if data.size < needed:
        raise PixelError(
            f"{data.size} bytes are no {lines} lines of {used_bytes} + {padding_bytes} bytes"
        )
    return np.ascontiguousarray(data[:needed].reshape(lines, -1)[:, :used_bytes]).reshape(-1)


def _of_colours(
    pixels: GreyImage, colours: str, *, wanted: bool
) -> tuple[GreyImage, ColourImage | None]:
    in_order = pixels if colours == "RGB" else pixels[..., ::-1]
    rgb = np.ascontiguousarray(in_order, np.uint8)
    return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8), rgb if wanted else None


def _bytes(data: Bytes) -> GreyImage:
    return data.copy()


def _pairs_of_bytes(data: Bytes) -> GreyImage:
    return np.frombuffer(data.tobytes(), "<u2").astype(np.uint16)


def _groups(data: Bytes, size: int) -> list[NDArray[np.uint16]]:
    """Return the first, second, ... byte of every group; the last group may end early."""
    padded = np.zeros(-(-data.size // size) * size, np.uint16)
    padded[: data.size] = data
    return list(padded.reshape(-1, size).T)


def _woven(*pixels: NDArray[np.integer]) -> GreyImage:
    return np.stack(pixels, axis=-1).reshape(-1).astype(np.uint16)


def _ten_p(data: Bytes) -> GreyImage:
    a, b, c, d, e = _groups(data, 5)
    return _woven(a | (b & 3) << 8, b >> 2 | (c & 15) << 6, c >> 4 | (d & 63) << 4, d >> 6 | e << 2)


def _twelve_p(data: Bytes) -> GreyImage:
    a, b, c = _groups(data, 3)
    return _woven(a | (b & 15) << 8, b >> 4 | c << 4)


def _ten_packed(data: Bytes) -> GreyImage:
    a, b, c = _groups(data, 3)
    return _woven(a << 2 | b & 3, c << 2 | b >> 4 & 3)


def _twelve_packed(data: Bytes) -> GreyImage:
    a, b, c = _groups(data, 3)
    return _woven(a << 4 | b & 15, c << 4 | b >> 4)


_UNPACKED: Final[dict[tuple[str, int], Callable[[Bytes], GreyImage]]] = {
    ("", 8): _bytes,
    **dict.fromkeys((("", 10), ("", 12), ("", 14), ("", 16)), _pairs_of_bytes),
    ("p", 10): _ten_p,
    ("p", 12): _twelve_p,
    ("Packed", 10): _ten_packed,
    ("Packed", 12): _twelve_packed,
}
"""By packing and bits: from bytes to values, perhaps with more behind the last one."""
