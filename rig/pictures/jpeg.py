"""The size that a JPEG claims (ITU-T T.81, annex B)."""

from typing import Final

from rig.pictures.size import PictureError, require_size

MAGIC: Final = b"\xff\xd8"
_FRAMES: Final = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_PROGRESSIVE: Final = frozenset({0xC2, 0xC6, 0xCA, 0xCE})
_ALONE: Final = frozenset({0x01, *range(0xD0, 0xD9)})
"""Marks without a body."""
_SCAN: Final = 0xDA
_MOST_SCANS: Final = 100
"""Each costs a pass over the whole picture; the usual progressive file has ten."""


def plain_jpeg(content: bytes) -> bytes:
    """Return the picture as it is.

    Raises:
        PictureError: it has no size or no end, or is larger than pictures are.
    """
    at = len(MAGIC)
    while at + 4 <= len(content):
        if content[at] != 0xFF:
            raise PictureError("is damaged: no mark where one belongs")
        mark = content[at + 1]
        if mark == 0xFF or mark in _ALONE:
            at += 1 if mark == 0xFF else 2
            continue
        if mark in _FRAMES:
            _require_frame(content[at + 4 : at + 10], is_progressive=mark in _PROGRESSIVE)
            _require_scans(content, at)
            return content
        at += 2 + int.from_bytes(content[at + 2 : at + 4], "big")
    raise PictureError("is damaged: its size is missing")


def _require_frame(head: bytes, *, is_progressive: bool) -> None:
    if len(head) < 6:
        raise PictureError("is cut off")
    height, width, channels = int.from_bytes(head[1:3]), int.from_bytes(head[3:5]), head[5]
    # All coefficients of a progressive picture are in memory, 16 bit each.
    require_size(width, height, channels * (3 if is_progressive else 1))


def _require_scans(content: bytes, at: int) -> None:
    scans = content.count(bytes([0xFF, _SCAN]), at)
    if scans > _MOST_SCANS:
        raise PictureError(f"has {scans} scans, most are {_MOST_SCANS}")
    if scans == 0 or b"\xff\xd9" not in content[at:]:
        raise PictureError("is cut off: its end is missing")
