"""The size that a TIFF claims, from the directory of its first picture (TIFF 6.0, section 2)."""

import struct
from typing import Final

from rig.pictures.size import PictureError, require_size

MAGICS: Final = (b"II*\x00", b"MM\x00*")
_TYPES: Final = {1: "B", 3: "H", 4: "I"}
"""Whole numbers, by type of field."""
_WIDTH, _HEIGHT, _BITS, _CHANNELS = 256, 257, 258, 277
_TILE_WIDTH, _TILE_HEIGHT = 322, 323


def plain_tiff(content: bytes) -> bytes:
    """Return the picture as it is.

    Raises:
        PictureError: it has no size, or is larger than pictures are.
    """
    order = "<" if content[:1] == b"I" else ">"
    try:
        found = _directory(content, order)
    except struct.error as error:
        raise PictureError("is cut off: the directory of its picture is missing") from error
    if _WIDTH not in found or _HEIGHT not in found:
        raise PictureError("is damaged: its size is missing")
    # A number of bits that is no byte is unpacked to the next larger kind of number.
    pixel_bytes = max(1, found.get(_CHANNELS, 1)) * max(1, (found.get(_BITS, 1) + 7) // 8)
    require_size(found[_WIDTH], found[_HEIGHT], pixel_bytes)
    if _TILE_WIDTH in found or _TILE_HEIGHT in found:
        require_size(found.get(_TILE_WIDTH, 0), found.get(_TILE_HEIGHT, 0), pixel_bytes)
    return content


def _directory(content: bytes, order: str) -> dict[int, int]:
    """Return the first number of every field; of two of one name the larger."""
    (at,) = struct.unpack_from(f"{order}I", content, 4)
    (count,) = struct.unpack_from(f"{order}H", content, at)
    found: dict[int, int] = {}
    for place in range(at + 2, at + 2 + 12 * count, 12):
        tag, kind, numbers = struct.unpack_from(f"{order}HHI", content, place)
        if kind not in _TYPES or numbers == 0:
            continue
        where = place + 8
        if numbers * struct.calcsize(_TYPES[kind]) > 4:
            (where,) = struct.unpack_from(f"{order}I", content, where)
        (number,) = struct.unpack_from(f"{order}{_TYPES[kind]}", content, where)
        found[tag] = max(number, found.get(tag, 0))
    return found
