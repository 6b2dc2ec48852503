"""Pictures in every form that is read, as small valid files, and changes that suit them."""

import random
import struct
import zlib
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.fuzz import mutate, structured

_PNG = b"\x89PNG\r\n\x1a\n"
_STEPS = (
    *((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4)),
    *((0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)),
)
"""Of Adam7: first column, first row, steps (PNG, section 8.2)."""
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}


def valid_pictures() -> list[tuple[str, bytes]]:
    """Return suffix and content of each."""
    grey = np.random.default_rng(1).integers(0, 256, (24, 32)).astype(np.uint8)
    deep = grey.astype(np.uint16) * 257
    colour = np.dstack([grey, grey[::-1], grey])
    clear = np.dstack([colour, grey])
    found: list[tuple[str, bytes]] = [
        ("png", _png(kind, bits, is_woven=woven))
        for kind, bits in (*((0, 1), (0, 8), (0, 16), (2, 8), (3, 2), (3, 8), (4, 8), (6, 16)),)
        for woven in (0, 1)
    ]
    found += [("tiff", _encoded(".tiff", image)) for image in (grey, deep, colour, clear)]
    found += [("tiff", _two_channels()), ("bmp", _encoded(".bmp", grey)), ("bmp", _old_bitmap())]
    for image in (grey, colour):
        found += [("jpg", _encoded(".jpg", image)), ("webp", _encoded(".webp", image))]
        found.append(("jpg", _encoded(".jpg", image, cv2.IMWRITE_JPEG_PROGRESSIVE, 1)))
        found.append(("webp", _encoded(".webp", image, cv2.IMWRITE_WEBP_QUALITY, 60)))
    found.append(("webp", _encoded(".webp", clear, cv2.IMWRITE_WEBP_QUALITY, 60)))
    for image, suffix in ((grey, ".pgm"), (deep, ".pgm"), (colour, ".ppm"), (grey, ".pbm")):
        found.append((suffix[1:], _encoded(suffix, image)))
        found.append((suffix[1:], _encoded(suffix, image, cv2.IMWRITE_PXM_BINARY, 0)))
    return found


def changed(rng: random.Random, suffix: str, valid: bytes) -> bytes:
    """Change a picture by its own structure, or its bytes."""
    chance = rng.random()
    if suffix == "png" and chance < 0.8:
        return structured.png(rng, valid)
    if suffix == "jpg" and chance < 0.6:
        return _jpeg(rng, valid)
    if suffix in {"pgm", "ppm", "pbm"} and chance < 0.5:
        head = valid[:24].decode("latin1")
        return mutate.text(rng, head).encode("latin1", errors="replace") + valid[24:]
    if suffix in {"bmp", "webp", "tiff"} and chance < 0.6:
        return _head(rng, valid)
    return mutate.raw(rng, valid)


def _encoded(suffix: str, image: NDArray[np.uint8] | NDArray[np.uint16], *options: int) -> bytes:
    return cv2.imencode(suffix, image, options)[1].tobytes()


def _png(colour: int, bits: int, *, is_woven: int) -> bytes:
    """A picture of 9 x 7 px whose rows have no filter."""
    width, height = 9, 7
    passes = _STEPS if is_woven else ((0, 0, 1, 1),)
    rng = np.random.default_rng(colour + bits)
    pixels = b""
    for x, y, step_x, step_y in passes:
        columns, rows = -((x - width) // step_x), -((y - height) // step_y)
        row_bytes = (max(columns, 0) * bits * _CHANNELS[colour] + 7) // 8
        for _ in range(max(rows, 0) if row_bytes else 0):
            pixels += b"\0" + rng.bytes(row_bytes)
    parts = [(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, is_woven))]
    if colour == 3:
        parts.append((b"PLTE", bytes(range(3 * 2**bits))[:768] if bits < 8 else rng.bytes(768)))
        parts.append((b"tRNS", b"\x80"))
    parts += [(b"IDAT", zlib.compress(pixels)), (b"IEND", b"")]
    return _PNG + b"".join(structured.png_part(name, body) for name, body in parts)


def _two_channels() -> bytes:
    """A TIFF of grey and opacity, which OpenCV does not write (TIFF 6.0, section 8)."""
    tags = (
        *((256, 3, 1, 4), (257, 3, 1, 4), (258, 3, 2, 0x00080008), (259, 3, 1, 1)),
        *((262, 3, 1, 1), (273, 4, 1, 200), (277, 3, 1, 2), (278, 3, 1, 4), (279, 4, 1, 32)),
        (338, 3, 1, 2),
    )
    body = struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", *tag) for tag in tags)
    return (b"II*\0" + struct.pack("<I", 8) + body).ljust(200, b"\0") + bytes(range(32))


def _old_bitmap() -> bytes:
    """A BMP whose header is the first there was."""
    pixels = bytes(range(48))
    head = b"BM" + struct.pack("<IHHI", 26 + len(pixels), 0, 0, 26)
    return head + struct.pack("<IHHHH", 12, 4, 4, 1, 24) + pixels


def _jpeg(rng: random.Random, valid: bytes) -> bytes:
    """Leave out, double or change marks with their bodies; more scans than any picture has."""
    marks = list(_marks(valid))
    at = rng.randrange(len(marks))
    match rng.randrange(7):
        case 0:
            del marks[at]
        case 1:
            marks.insert(at, marks[rng.randrange(len(marks))])
        case 2:
            marks[at] = mutate.raw(rng, marks[at])
        case 3:
            marks.insert(at, rng.choice((b"\xff\xff\xff", b"\xff\x01", b"\xff\xd0", b"\xff")))
        case 4:
            marks.insert(-1, marks[-1][:-2] * rng.choice((2, 101, 300)))
        case 5:
            marks = marks[: at + 1]
            marks[-1] = marks[-1][: rng.randrange(1, 12)]
        case _:
            marks[at] = marks[at][:2] + mutate.raw(rng, marks[at][2:20]) + marks[at][20:]
    return b"\xff\xd8" + b"".join(marks)


def _marks(valid: bytes) -> Iterator[bytes]:
    """Yield marks with their bodies; the first scan with all that follows is one."""
    at = 2
    while valid[at + 1] != 0xDA:
        length = 2 + int.from_bytes(valid[at + 2 : at + 4], "big")
        yield valid[at : at + length]
        at += length
    yield valid[at:]


def _head(rng: random.Random, valid: bytes) -> bytes:
    """Change a number among the first ones, or what follows the kind of a file."""
    size = rng.choice((1, 2, 4))
    at = rng.randrange(0, 64, size) if rng.random() < 0.7 else rng.randrange(len(valid))
    number = rng.choice((0, 1, 2, 255, 65_535, 32_768, 60_000, 2**31, 2**32 - 1, 9, 12))
    if rng.random() < 0.1:
        return valid[: rng.randrange(4, 40)]
    if valid[:4] == b"RIFF" and rng.random() < 0.3:
        kind = rng.choice((b"VP8 ", b"VP8L", b"VP8X", b"ALPH", b"ANIM"))
        return valid[:12] + kind + valid[16:20] + bytes([rng.choice((0, 2, 16))]) + valid[21:]
    packed = (number % 2 ** (8 * size)).to_bytes(size, rng.choice(("little", "big")))
    return valid[:at] + packed + valid[at + size :]
