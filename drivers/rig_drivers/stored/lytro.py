"""Raw pictures of Lytro cameras: their container (LFP, LFR), and the bare pixels beside it (RAW).

A container is a row of sections: a magic number of 8 bytes, version and length as big-endian
32-bit numbers, and, in all but the first, a SHA-1 as text of 80 bytes before the content; every
section ends at a multiple of 16 bytes. Their table of contents and their metadata are JSON; the
metadata names the section of the picture by its SHA-1. Pixels are packed: two of 12 bit in 3 bytes
(Illum: four of 10 bit in 5), or lie as 16-bit numbers.

Source: the public descriptions of the format by N. Patel ("lfptools", 2012) and J. Kucera ("Light
Field Photography and its Cameras", 2014).
"""

import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from rig.errors import DeviceLostError
from rig.frames import GreyImage

_NAME = "raw picture"
_MAGIC = b"\x89LF"
_SECTION_START = b"\x0d\x0a\x1a\x0a"
_REFERENCE_BYTES = 80
_MOST_SECTIONS = 1000
_MOST_JSON_BYTES = 16_000_000
_LONGEST_SIDE_PX = 20_000
_BARE_SIZES_PX = {(3280, 3280): 12, (7728, 5368): 10}
"""Bits per pixel of the cameras whose pixels come without a header, by width and height."""


def is_lytro(path: Path, data: NDArray[np.uint8]) -> bool:
    """Tell whether bytes are a container of a Lytro camera, or its bare pixels."""
    if bytes(data[:3]) == _MAGIC:
        return True
    return path.suffix.lower() == ".raw" and _bare_size_px(data) is not None


def lytro_raw(path: Path, data: NDArray[np.uint8]) -> GreyImage:
    """Return the pixels (H, W) of a raw picture, behind their colour filters, 16 bit.

    Args:
        path: of the file, for messages.
        data: its bytes.

    Raises:
        DeviceLostError: it is damaged, or holds no raw picture.
    """
    if bytes(data[:3]) != _MAGIC:
        size_px = _bare_size_px(data)
        if size_px is None:
            raise _damaged(path, f"{data.size} bytes are no raw picture of a known size")
        return _unpacked(path, data, size_px, _BARE_SIZES_PX[size_px], is_little=False)
    sections = dict(_sections(path, data))
    told = [meta for content in sections.values() if (meta := _as_json(content)) is not None]
    whole: dict[str, Any] = {}
    for meta in told:
        whole.update(meta.get("picture", meta) if isinstance(meta.get("picture"), dict) else meta)
    # The frame list names the metadata and the pixels of a picture by their sections.
    frame = _first(whole, ("frameArray", 0, "frame"))
    beside = _as_json(sections.get(str(_first(frame, ("metadataRef",))), data[:0]))
    pixels = _first(frame, ("imageRef",))
    if beside is not None and isinstance(beside.get("image"), dict):
        whole["image"] = {**beside["image"], "imageRef": pixels}
    found = _picture_of(path, whole)
    if found is None or found[0] not in sections:
        raise _damaged(path, "no metadata in it names a raw picture that is in it too")
    reference, size_px, bits, is_little = found
    return _unpacked(path, sections[reference], size_px, bits, is_little=is_little)


def _bare_size_px(data: NDArray[np.uint8]) -> tuple[int, int] | None:
    sizes = {w * h * bits // 8: (w, h) for (w, h), bits in _BARE_SIZES_PX.items()}
    return sizes.get(data.size)


def _sections(path: Path, data: NDArray[np.uint8]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Yield reference and content of every section behind the first."""
    place = 0
    for _ in range(_MOST_SECTIONS):
        while place < data.size and data[place] == 0:
            place += 1
        if place >= data.size:
            return
        head = bytes(data[place : place + 16])
        if len(head) < 16 or head[:3] != _MAGIC or head[4:8] != _SECTION_START:
            raise _damaged(path, f"no section begins at byte {place}")
        (length,) = struct.unpack(">I", head[12:16])
        place += 16
        if length:
            start = place + _REFERENCE_BYTES
            if start + length > data.size:
                raise _damaged(
                    path, f"a section of {length} bytes begins at byte {start} of {data.size}"
                )
            reference = bytes(data[place:start]).rstrip(b"\0").decode("ascii", "replace")
            yield reference, data[start : start + length]
            place = start + length
        place += -place % 16
    raise _damaged(path, f"it has more than {_MOST_SECTIONS} sections")


def _as_json(content: NDArray[np.uint8]) -> Mapping[str, Any] | None:
    if content.size > _MOST_JSON_BYTES or not content.size or content[0] not in b"{ \t\r\n":
        return None
    try:
        found: object = json.loads(content.tobytes().rstrip(b"\0"))
    except (ValueError, RecursionError):
        return None
    return cast("Mapping[str, Any]", found) if isinstance(found, dict) else None


def _picture_of(
    path: Path, meta: Mapping[str, Any]
) -> tuple[str, tuple[int, int], int, bool] | None:
    """Reference, size, bits and byte order of the picture that metadata tell of; None for none.

    The metadata of the first camera lie apart from the list of its frames: see `lytro_raw`.
    """
    details = _first(meta, ("image",))
    frame = _first(meta, ("frames", 0, "frame"))
    reference = _first(frame, ("imageRef",)) or _first(details, ("imageRef",))
    details = _first(frame, ("metadata", "image")) or details
    if not isinstance(details, dict) or not isinstance(reference, str):
        return None
    width, height = _first(details, ("width",)), _first(details, ("height",))
    packing = _first(details, ("rawDetails", "pixelPacking")) or _first(details, ("pixelPacking",))
    bits = _first(packing, ("bitsPerPixel",))
    if not all(type(n) is int and 0 < n <= _LONGEST_SIDE_PX for n in (width, height)):
        raise _damaged(path, f"its picture has {width} x {height} px by its metadata")
    if bits not in (10, 12, 16):
        raise _damaged(path, f"its pixels have {bits} bits by its metadata, known are 10, 12, 16")
    is_little = _first(packing, ("endianness",)) == "little"
    return reference, (cast("int", width), cast("int", height)), cast("int", bits), is_little


def _first(found: object, steps: tuple[str | int, ...]) -> object:
    """Follow keys and indices through JSON; None where they lead nowhere."""
    for step in steps:
        if isinstance(step, int):
            if not isinstance(found, list) or len(found) <= step:
                return None
            found = cast("list[object]", found)[step]
        else:
            if not isinstance(found, dict):
                return None
            found = cast("dict[str, object]", found).get(step)
    return found


def _unpacked(
    path: Path, data: NDArray[np.uint8], size_px: tuple[int, int], bits: int, *, is_little: bool
) -> NDArray[np.uint16]:
    width, height = size_px
    needed = width * height * bits // 8
    if data.size < needed or width * height * bits % 8:
        raise _damaged(
            path, f"{width} x {height} px of {bits} bit take {needed} bytes, it holds {data.size}"
        )
    packed = np.ascontiguousarray(data[:needed])
    if bits == 16:
        order = "<u2" if is_little else ">u2"
        return packed.view(order).astype(np.uint16).reshape(height, width)
    if bits == 12:
        triple = packed.reshape(-1, 3).astype(np.uint16)
        first = triple[:, 0] << 4 | triple[:, 1] >> 4
        second = (triple[:, 1] & 0x0F) << 8 | triple[:, 2]
        return np.stack([first, second], axis=-1).reshape(height, width).astype(np.uint16)
    five = packed.reshape(-1, 5).astype(np.uint16)
    low = [(five[:, 4] >> shift) & 0x03 for shift in (0, 2, 4, 6)]
    pixels = [five[:, k] << 2 | low[k] for k in range(4)]
    return np.stack(pixels, axis=-1).reshape(height, width).astype(np.uint16)


def _damaged(path: Path, what: str) -> DeviceLostError:
    return DeviceLostError(
        _NAME, f"{path}: {what}", advice="give another file, or its raw picture as PNG or TIFF"
    )
