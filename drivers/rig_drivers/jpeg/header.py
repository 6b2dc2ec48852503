"""The head of a baseline JPEG picture: what its scan needs, read strictly.

Source: ITU-T T.81, annexes B (markers) and C (codes of a Huffman table); what motion JPEG leaves
out (the Huffman tables) is that of annex K.3.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

_START, _FRAME, _SCAN = 0xD8, 0xC0, 0xDA
_EXTENDED: Final = 0xC1
"""Sequential like the baseline; the same for 8 bits and two tables of each class."""
_HUFFMAN, _QUANTISATION, _RESTART = 0xC4, 0xDB, 0xDD
_OTHER_FRAMES: Final = frozenset(range(0xC0, 0xD0)) - {_FRAME, _EXTENDED, _HUFFMAN, 0xC8, 0xCC}
_FILL: Final = 0xFF
_BLOCK_PX: Final = 8
_MOST_BLOCKS: Final = 10
"""Blocks of one unit of a scan at most (B.2.3)."""


class JpegDamageError(ValueError):
    """The bytes are no undamaged JPEG picture."""


class ForeignJpegError(JpegDamageError):
    """A picture that no camera sends, but perhaps a whole one."""


@dataclass(frozen=True, slots=True)
class Component:
    """One colour component of the frame."""

    identifier: int
    across: int
    """Blocks of one unit side by side,"""
    down: int
    """and on top of each other."""
    quantisation: int


@dataclass(frozen=True, slots=True)
class JpegHeader:
    """What stands before the coded pixels."""

    width_px: int
    height_px: int
    components: tuple[Component, ...]
    quantisation: NDArray[np.int64]
    """By component: steps of the coefficients in their coded order, (components, 64)."""
    codes: NDArray[np.uint16]
    """By component and class (DC, AC): `code_table`, (components, 2, 65536)."""
    units_per_restart: int
    """Units from restart marker to restart marker; 0: there are none."""
    scan_at: int
    """Where the coded pixels begin."""

    @property
    def units_across(self) -> int:
        """Units side by side in the picture."""
        return -(-self.width_px // self.unit_px[0])

    @property
    def units_down(self) -> int:
        """Units on top of each other."""
        return -(-self.height_px // self.unit_px[1])

    @property
    def unit_px(self) -> tuple[int, int]:
        """Width and height of a unit: the smallest piece that holds blocks of all components."""
        return (
            _BLOCK_PX * max(component.across for component in self.components),
            _BLOCK_PX * max(component.down for component in self.components),
        )


class _Tables:
    def __init__(self) -> None:
        self.quantisation: dict[int, NDArray[np.int64]] = {}
        self.huffman: dict[tuple[int, int], bytes] = dict(_STANDARD)
        self.restart = 0
        self.frame: tuple[int, int, tuple[Component, ...]] | None = None

    def read(self, marker: int, body: bytes) -> None:
        """Take one segment in; those that say nothing about the pixels are passed over."""
        if marker in (_FRAME, _EXTENDED):
            if self.frame is not None:
                raise JpegDamageError("two frames in one picture")
            self.frame = _frame(body)
        elif marker == _QUANTISATION:
            self.quantisation |= _quantisation(body)
        elif marker == _HUFFMAN:
            self.huffman |= _huffman(body)
        elif marker == _RESTART:
            if len(body) != 2:
                raise JpegDamageError("restart interval of the wrong length")
            self.restart = int.from_bytes(body)
        elif marker in _OTHER_FRAMES:
            raise ForeignJpegError(f"frame type {marker:#x} is none that cameras send")
        elif marker < 0xE0 and marker != 0xDC:
            raise JpegDamageError(f"marker {marker:#x} before the scan")


def read_header(content: bytes) -> JpegHeader:
    """Read everything before the coded pixels.

    Args:
        content: a picture from its start mark on.

    Raises:
        JpegDamageError: it is no picture that a camera sends, or its structure is damaged.
    """
    if content[:2] != bytes((_FILL, _START)):
        raise JpegDamageError("no start mark")
    tables, at = _Tables(), 2
    while True:
        marker, at = _marker(content, at)
        length = int.from_bytes(content[at : at + 2])
        body = content[at + 2 : at + length]
        if length < 2 or len(body) != length - 2:
            raise JpegDamageError("a segment is cut off")
        at += length
        if marker == _SCAN:
            return _header(tables, body, at)
        tables.read(marker, body)


def _marker(content: bytes, at: int) -> tuple[int, int]:
    """Return the next marker and where its segment begins; what stands before it says nothing."""
    while True:
        at = content.find(_FILL, at)
        if at < 0:
            raise JpegDamageError("no scan")
        while at < len(content) and content[at] == _FILL:
            at += 1
        if at >= len(content):
            raise JpegDamageError("no scan")
        if content[at]:
            return content[at], at + 1


def _frame(body: bytes) -> tuple[int, int, tuple[Component, ...]]:
    if len(body) < 6 or len(body) != 6 + 3 * body[5]:
        raise JpegDamageError("a frame is cut off")
    if body[0] != 8 or body[5] not in (1, 3):
        raise ForeignJpegError("no frame of 8 bits with one or three components")
    height_px, width_px = int.from_bytes(body[1:3]), int.from_bytes(body[3:5])
    components = tuple(
        Component(body[at], body[at + 1] >> 4, body[at + 1] & 15, body[at + 2])
        for at in range(6, len(body), 3)
    )
    if len(components) == 1:  # its blocks come one by one, whatever its sampling says
        components = (Component(components[0].identifier, 1, 1, components[0].quantisation),)
    samplings = [(c.across, c.down) for c in components]
    if not all(1 <= across <= 4 and 1 <= down <= 4 for across, down in samplings):
        raise JpegDamageError("impossible sampling factors")
    if sum(across * down for across, down in samplings) > _MOST_BLOCKS:
        raise JpegDamageError("more blocks in a unit than there may be")
    if not (width_px and height_px):
        raise JpegDamageError("a frame without pixels")
    return width_px, height_px, components


def _quantisation(body: bytes) -> dict[int, NDArray[np.int64]]:
    found: dict[int, NDArray[np.int64]] = {}
    at = 0
    while at < len(body):
        number, width = body[at] & 15, 1 + (body[at] >> 4)
        values = body[at + 1 : at + 1 + 64 * width]
        if number > 3 or width > 2 or len(values) != 64 * width:
            raise JpegDamageError("a quantisation table is damaged")
        found[number] = np.frombuffer(values, f">u{width}").astype(np.int64)
        at += 1 + 64 * width
    return found


def _huffman(body: bytes) -> dict[tuple[int, int], bytes]:
    found: dict[tuple[int, int], bytes] = {}
    at = 0
    while at < len(body):
        counts = body[at + 1 : at + 17]
        end = at + 17 + sum(counts)
        key = body[at] >> 4, body[at] & 15
        if len(counts) != 16 or end > len(body) or key[0] > 1 or key[1] > 3:
            raise JpegDamageError("a Huffman table is damaged")
        found[key] = body[at + 1 : end]
        at = end
    return found


def _header(tables: _Tables, body: bytes, scan_at: int) -> JpegHeader:
    if tables.frame is None:
        raise JpegDamageError("a scan without a frame")
    width_px, height_px, components = tables.frame
    count = len(components)
    if len(body) != 4 + 2 * count or body[0] != count or body[-3:] != b"\0\x3f\0":
        raise ForeignJpegError("no scan of all components")
    quantisation = np.empty((count, 64), np.int64)
    codes = np.empty((count, 2, 1 << 16), np.uint16)
    for place, component in enumerate(components):
        identifier, chosen = body[1 + 2 * place], body[2 + 2 * place]
        if identifier != component.identifier:
            raise JpegDamageError("frame and scan name different components")
        steps = tables.quantisation.get(component.quantisation)
        direct, alternating = (0, chosen >> 4), (1, chosen & 15)
        if steps is None or direct not in tables.huffman or alternating not in tables.huffman:
            raise JpegDamageError("a table is missing")
        quantisation[place] = steps
        codes[place, 0] = code_table(tables.huffman[direct])
        codes[place, 1] = code_table(tables.huffman[alternating])
    return JpegHeader(width_px, height_px, components, quantisation, codes, tables.restart, scan_at)


@lru_cache(maxsize=16)  # a camera sends the same tables with every picture
def code_table(table: bytes) -> NDArray[np.uint16]:
    """Return by the next 16 bits: 256 times the length of their code, and its symbol; 0 for none.

    Args:
        table: 16 counts of codes by length, then the symbols.

    Raises:
        JpegDamageError: more codes than their lengths allow.
    """
    codes = np.zeros(1 << 16, np.uint16)
    at, symbols = 0, iter(table[16:])
    for length, count in enumerate(table[:16], start=1):
        for _ in range(count):
            end = at + (1 << (16 - length))
            if end > codes.size:
                raise JpegDamageError("a Huffman table has too many codes")
            codes[at:end] = length << 8 | next(symbols)
            at = end
    return codes


def _standard(counts: str, symbols: str) -> bytes:
    return bytes.fromhex(counts) + bytes.fromhex(symbols)


_STANDARD: Final = {
    (0, 0): _standard("00010501010101010100000000000000", "000102030405060708090a0b"),
    (0, 1): _standard("00030101010101010101010000000000", "000102030405060708090a0b"),
    (1, 0): _standard(
        "0002010303020403050504040000017d",
        "01020300041105122131410613516107227114328191a1082342b1c11552d1f02433627282090a161718191a"
        "25262728292a3435363738393a434445464748494a535455565758595a636465666768696a73747576777879"
        "7a838485868788898a92939495969798999aa2a3a4a5a6a7a8a9aab2b3b4b5b6b7b8b9bac2c3c4c5c6c7c8c9"
        "cad2d3d4d5d6d7d8d9dae1e2e3e4e5e6e7e8e9eaf1f2f3f4f5f6f7f8f9fa",
    ),
    (1, 1): _standard(
        "00020102040403040705040400010277",
        "0001020311040521310612415107617113223281081442"
        "91a1b1c109233352f0156272d10a162434e125f11718191a262728292a35363738393a434445464748494a53"
        "5455565758595a636465666768696a737475767778797a82838485868788898a92939495969798999aa2a3a4"
        "a5a6a7a8a9aab2b3b4b5b6b7b8b9bac2c3c4c5c6c7c8c9cad2d3d4d5d6d7d8d9dae2e3e4e5e6e7e8e9eaf2f3"
        "f4f5f6f7f8f9fa",
    ),
}
"""By class and number: the tables of cameras that send none."""
