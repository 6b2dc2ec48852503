"""RAW10: ten bits per pixel, four pixels in five bytes (MIPI CSI-2 specification, RAW10).

byte 0..3   the upper eight bits of pixels 0..3
byte 4      their lower two bits; pixel 0 in bits 1:0, pixel 3 in bits 7:6
"""

import numpy as np
from numpy.typing import NDArray

_SHIFTS = np.array([0, 2, 4, 6], np.uint8)


def packed_bytes(width_px: int) -> int:
    """Return the bytes that one row of pixels fills; the last group of four may be incomplete."""
    return -(-width_px // 4) * 5


def unpack_raw10(
    data: NDArray[np.uint8], *, width_px: int, height_px: int, stride: int | None = None
) -> NDArray[np.uint16]:
    """Return the pixels of a packed image.

    Args:
        data: the rows, one after the other.
        width_px: pixels per row.
        height_px: rows.
        stride: bytes from the start of one row to the next; None where rows are not padded.

    Returns:
        (H, W), 0..1023.

    Raises:
        ValueError: `data` or `stride` is too short for this size.
    """
    row_bytes = packed_bytes(width_px)
    stride = row_bytes if stride is None else stride
    if stride < row_bytes:
        raise ValueError(f"a row of {width_px} px fills {row_bytes} bytes, rows are {stride} apart")
    needed = stride * (height_px - 1) + row_bytes
    if data.size < needed:
        raise ValueError(
            f"{width_px} x {height_px} px in RAW10 fill {needed} bytes, found {data.size}"
        )
    rows = np.lib.stride_tricks.as_strided(
        data.reshape(-1), (height_px, row_bytes // 5, 5), (stride, 5, 1), writeable=False
    )
    lower = np.ascontiguousarray(rows[..., 4])
    pixels = np.empty((height_px, row_bytes // 5, 4), np.uint16)
    pixels[...] = rows[..., :4]
    pixels <<= 2
    for index, shift in enumerate(_SHIFTS):
        pixels[..., index] |= (lower >> shift) & np.uint8(3)
    return pixels.reshape(height_px, -1)[:, :width_px]


def pack_raw10(image: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return an image of ten-bit pixels packed, rows without padding; the inverse of unpacking.

    Args:
        image: (H, W), 0..1023.

    Returns:
        (H * packed_bytes(W),).

    Raises:
        ValueError: a pixel needs more than ten bits.
    """
    if image.size and int(image.max()) > 1023:
        raise ValueError(f"RAW10 holds 0..1023, found {int(image.max())}")
    height, width = image.shape
    groups = np.zeros((height, -(-width // 4) * 4), np.uint16)
    groups[:, :width] = image
    groups = groups.reshape(height, -1, 4)
    packed = np.empty((*groups.shape[:2], 5), np.uint8)
    packed[..., :4] = groups >> 2
    packed[..., 4] = np.bitwise_or.reduce((groups & 3) << _SHIFTS, axis=-1)
    return packed.reshape(-1)
