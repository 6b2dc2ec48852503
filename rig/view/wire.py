"""One message of the live page: a JSON header and the arrays it names, in one binary piece.

    uint32, little endian    length of the header in bytes
    header                   JSON in UTF-8; `arrays` lists name, type, shape and start of each array
    arrays                   little endian, rows first, each at a multiple of 8 bytes from the start

A browser views the arrays in place: nothing is copied and nothing is decoded.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.errors import FormatError

ALIGNMENT: Final = 8
TYPES: Final = ("uint8", "uint16", "float32")
"""Types of arrays that a page reads."""
_LENGTH: Final = struct.Struct("<I")


def encode(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return one message.

    Args:
        header: plain values; infinite numbers and NaN have no place in JSON.
        arrays: of one of `TYPES` each, by name.

    Raises:
        FormatError: an array of another type, or a header that is no JSON.
    """
    listed: list[dict[str, object]] = []
    start = 0
    for name, array in arrays.items():
        if array.dtype.name not in TYPES:
            raise FormatError(
                f"array {name} of {array.dtype} for the live page",
                advice=f"give one of {', '.join(TYPES)}",
            )
        listed.append(
            {"name": name, "type": array.dtype.name, "shape": list(array.shape), "start": start}
        )
        start = _aligned(start + array.nbytes)
    try:
        text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    except (TypeError, ValueError) as error:
        raise FormatError(
            f"a header for the live page that is no JSON: {error}",
            advice="give plain, finite values",
        ) from error
    text += b" " * (-(_LENGTH.size + len(text)) % ALIGNMENT)
    pieces: list[Any] = [_LENGTH.pack(len(text)), text]
    for array in arrays.values():
        pieces += (np.ascontiguousarray(array).data, b"\0" * (-array.nbytes % ALIGNMENT))
    return b"".join(pieces)


def decode(message: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return header and arrays of a message; the arrays are read-only views into it.

    Raises:
        FormatError: it is no such message, or it is cut off.
    """
    try:
        (length,) = _LENGTH.unpack_from(message)
        body = _LENGTH.size + length
        header = json.loads(message[_LENGTH.size : body].decode())
        arrays = {
            str(entry["name"]): _array(message, body + int(entry["start"]), entry)
            for entry in header.pop("arrays")
        }
    except (struct.error, ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise FormatError(
            f"{len(message)} bytes that are no message of the live page: {error!r}"
        ) from error
    return header, arrays


def _array(message: bytes, start: int, entry: Mapping[str, Any]) -> NDArray[Any]:
    if entry["type"] not in TYPES or entry["start"] < 0 or min(entry["shape"], default=0) < 0:
        raise ValueError(f"array {entry}")
    count = int(np.prod(entry["shape"], dtype=np.int64))
    kind = np.dtype(entry["type"]).newbyteorder("<")
    return np.frombuffer(message, kind, count, start).reshape(entry["shape"])


def _aligned(size: int) -> int:
    return size + -size % ALIGNMENT
