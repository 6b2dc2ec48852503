"""The size that a PBM, PGM or PPM claims (https://netpbm.sourceforge.net/doc/pgm.html)."""

import re
from typing import Final

from rig.pictures.size import PictureError, require_size

MAGICS: Final = tuple(f"P{number}".encode() for number in range(1, 7))
_GAP: Final = rb"(?:\s|#[^\n]{0,1000}\n){1,100}"
_HEADER: Final = re.compile(
    rb"P([1-6])" + _GAP + rb"(\d{1,6})" + _GAP + rb"(\d{1,6})(?:" + _GAP + rb"(\d{1,6}))?\s"
)


def plain_netpbm(content: bytes) -> bytes:
    """Return the picture as it is.

    Raises:
        PictureError: it has no header or fewer bytes than pixels, or is larger than pictures are.
    """
    header = _HEADER.match(content)
    if header is None:
        raise PictureError("is damaged: no header of width and height")
    kind, width, height = (int(header.group(place)) for place in (1, 2, 3))
    most = int(header.group(4) or 1)
    channels = 3 if kind in {3, 6} else 1
    value_bytes = 2 if most > 255 else 1
    require_size(width, height, channels * value_bytes)
    if kind in {5, 6}:
        needed = width * height * channels * value_bytes
        left = len(content) - header.end()
        if not 1 <= most <= 65535 or left < needed:
            raise PictureError(f"is cut off: {left} bytes of pixels where {needed} belong")
    return content
