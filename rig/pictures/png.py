"""PNG down to what makes its pixels, each part checked (https://www.w3.org/TR/png-3/).

The decoder behind would unpack comments of any size, believe a part of a gigabyte in a file of
some kilobytes, and write its complaints to the terminal by itself.
"""

import struct
import zlib
from collections.abc import Iterator
from typing import Any, Final

from rig.pictures.size import PictureError, require_size

MAGIC: Final = b"\x89PNG\r\n\x1a\n"
_HEAD: Final = struct.Struct(">I4s")
_HEADER: Final = struct.Struct(">IIBBBBB")
_NEEDED: Final = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
_CHANNELS: Final = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""By colour type; 3 is a palette."""
_BITS: Final = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
_PASSES: Final = (
    (0, 0, 8, 8),
    (4, 0, 8, 8),
    (0, 4, 4, 8),
    (2, 0, 4, 4),
    (0, 2, 2, 4),
    (1, 0, 2, 2),
    (0, 1, 1, 2),
)
"""Of interlaced pictures: first column, first row, and the steps to the next ones."""
_PIECE: Final = 1 << 20


def plain_png(content: bytes) -> bytes:
    """Return the same picture of its necessary parts alone.

    Raises:
        PictureError: it is damaged, or larger than pictures are.
    """
    parts = list(_parts(content))
    if not parts or parts[0][0] != b"IHDR" or len(parts[0][1]) != _HEADER.size:
        raise PictureError("has no header")
    if sum(name == b"IHDR" for name, _ in parts) > 1:
        raise PictureError("has two headers")
    width, height, bits, colour, compression, filtering, interlace = _HEADER.unpack(parts[0][1])
    if bits not in _BITS.get(colour, ()) or compression or filtering or interlace > 1:
        raise PictureError("has a header that no PNG has")
    # Palettes and bits become colour with opacity.
    pixel_bytes = 4 if colour == 3 else _CHANNELS[colour] * (2 if bits == 16 else 1)
    require_size(width, height, pixel_bytes)
    row_bits = bits * _CHANNELS[colour]
    rows = _interlaced(width, height) if interlace else ((width, height),)
    _require_pixels(
        [body for name, body in parts if name == b"IDAT"],
        [(1 + (columns * row_bits + 7) // 8, count) for columns, count in rows],
    )
    _require_colours(dict(parts), colour, bits)
    kept = [_part(name, body) for name, body in parts if name in _NEEDED]
    return MAGIC + b"".join(kept)


def _parts(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = len(MAGIC)
    while at + _HEAD.size + 4 <= len(content):
        length, name = _HEAD.unpack_from(content, at)
        at += _HEAD.size
        if length > len(content) - at - 4:
            raise PictureError(
                f"is cut off: a part of {length} bytes where {len(content) - at} are"
            )
        body = content[at : at + length]
        (checksum,) = struct.unpack_from(">I", content, at + length)
        if zlib.crc32(body, zlib.crc32(name)) != checksum:
            raise PictureError(f"is damaged: the checksum of a part {name!r} is wrong")
        yield name, body
        if name == b"IEND":
            return
        at += length + 4
    raise PictureError("is cut off: its end is missing")


def _part(name: bytes, body: bytes) -> bytes:
    checksum = zlib.crc32(body, zlib.crc32(name))
    return _HEAD.pack(len(body), name) + body + checksum.to_bytes(4, "big")


def _interlaced(width: int, height: int) -> tuple[tuple[int, int], ...]:
    sizes = [
        ((width - x + step_x - 1) // step_x, (height - y + step_y - 1) // step_y)
        for x, y, step_x, step_y in _PASSES
    ]
    return tuple((columns, rows) for columns, rows in sizes if columns > 0 and rows > 0)


def _require_pixels(bodies: list[bytes], passes: list[tuple[int, int]]) -> None:
    """Unpack the pixels piece by piece, and look at the first byte of every row, its filter."""
    length = sum(row * count for row, count in passes)
    row_starts = _row_starts(passes)
    start, at = next(row_starts), 0
    unpacker = zlib.decompressobj()
    try:
        for piece in _pieces(unpacker, bodies):
            while start is not None and start < at + len(piece):
                if piece[start - at] > 4:
                    raise PictureError("is damaged: a row is coded in no known way")
                start = next(row_starts)
            at += len(piece)
            if at > length:
                raise PictureError(f"is damaged: more than the {length} bytes of its pixels")
    except zlib.error as error:
        raise PictureError(f"is damaged: {error}") from error
    if at != length or not unpacker.eof:
        raise PictureError(f"is damaged: {at} bytes of pixels where {length} belong")


def _row_starts(passes: list[tuple[int, int]]) -> Iterator[int | None]:
    at = 0
    for row, count in passes:
        yield from range(at, at + row * count, row)
        at += row * count
    while True:
        yield None


def _pieces(unpacker: Any, bodies: list[bytes]) -> Iterator[bytes]:
    for body in bodies:
        piece = unpacker.decompress(body, _PIECE)
        while piece:
            yield piece
            piece = unpacker.decompress(unpacker.unconsumed_tail, _PIECE)


def _require_colours(parts: dict[bytes, bytes], colour: int, bits: int) -> None:
    palette = parts.get(b"PLTE")
    if colour == 3 and palette is None:
        raise PictureError("has no palette")
    if palette is None:
        return
    if len(palette) % 3 or not 3 <= len(palette) <= 768:
        raise PictureError("has a palette that no PNG has")
    if colour == 3 and len(palette) > 3 * 2**bits:
        raise PictureError("has a palette that no PNG has")
