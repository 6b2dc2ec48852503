"""The sizes that a BMP and a WebP claim."""

import struct
from typing import Final

from rig.pictures.size import PictureError, require_size

BMP: Final = b"BM"
WEBP: Final = b"RIFF"


def plain_bmp(content: bytes) -> bytes:
    """Return the picture as it is.

    Raises:
        PictureError: it has no header, or is larger than pictures are.
    """
    if len(content) < 26:
        raise PictureError("is cut off")
    (head,) = struct.unpack_from("<I", content, 14)
    width, height = struct.unpack_from("<HH" if head == 12 else "<ii", content, 18)
    require_size(width, abs(height), 4)
    return content


def plain_webp(content: bytes) -> bytes:
    """Return the picture as it is (RFC 9649).

    Raises:
        PictureError: it is no still picture, or larger than pictures are.
    """
    kind, head = content[8:16], content[20:30]
    if len(head) < 10:
        raise PictureError("is cut off")
    if kind == b"WEBPVP8 ":
        width, height = (side & 0x3FFF for side in struct.unpack_from("<HH", head, 6))
    elif kind == b"WEBPVP8L":
        packed = int.from_bytes(head[1:5], "little")
        width, height = 1 + (packed & 0x3FFF), 1 + (packed >> 14 & 0x3FFF)
    elif kind == b"WEBPVP8X" and not head[0] & 2:
        width, height = (1 + int.from_bytes(head[at : at + 3], "little") for at in (4, 7))
    else:
        raise PictureError("is no still picture")
    require_size(width, height, 4)
    return content
