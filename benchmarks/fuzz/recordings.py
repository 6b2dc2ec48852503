"""Recordings in every way that they are written, and changes that suit them."""

import json
import random
import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import zstandard
from mcap.opcode import Opcode

from benchmarks.fuzz import mutate, structured
from rig.frames import MultiView
from rig.recording import RecordingWriter
from tests.support.recordings import VIEWS, taken, time_ns, written

OLD = Path(__file__).parents[2] / "tests" / "data" / "recording_of_old.mcap"
_CHUNK = struct.Struct("<QQQII")
"""First and last time, size and checksum of the records, length of a compression's name."""
_RECORD = struct.Struct("<BQ")
_FOUND_BITS = (0, 1, 8, 9, 10, 16, 17)


def valid_recordings(folder: Path) -> list[bytes]:
    """Return recordings of today, of 8 and 10 bit, with colour, packed, and the JSON of old."""
    found: list[bytes] = []
    for bits in (8, 10):
        path = folder / f"of_{bits}.mcap"
        written(path, 3, bits=bits)
        found.append(path.read_bytes())
    path = folder / "coloured.mcap"
    with RecordingWriter(path, VIEWS, {"kind": "any"}) as recording:
        for number in range(2):
            recording.write(_coloured(taken(number, bits=8)), time_ns(number))
    found += [path.read_bytes(), OLD.read_bytes()]
    return [*found, _packed(found[0], b"lz4"), _packed(found[2], b"zstd")]


def changed(rng: random.Random, valid: bytes) -> bytes:
    """Change records, the chunks around them, or the facts and pictures inside."""
    if rng.random() < 0.35:
        return structured.mcap(rng, valid, _body)
    records = structured.mcap_records(valid)
    chunks = [at for at, (opcode, _) in enumerate(records) if opcode == Opcode.CHUNK]
    if not chunks:
        return structured.mcap(rng, valid, _body)
    if rng.random() < 0.08:
        return _joined(records[: rng.randrange(len(records) + 1)])
    at = rng.choice(chunks)
    name, inside = _unpacked(records[at][1])
    for _ in range(rng.choice((1, 1, 2))):
        inside = _inside(rng, inside)
    records[at] = (int(Opcode.CHUNK), _chunk(rng, name, inside))
    return _joined(records)


def _coloured(multiview: MultiView) -> MultiView:
    frames = tuple(
        replace(frame, colour=np.dstack([frame.image] * 3).astype(np.uint8))
        for frame in multiview.frames
    )
    return replace(multiview, frames=frames)


def _packed(valid: bytes, name: bytes) -> bytes:
    """Return the same recording with its chunks compressed, as other writers do."""
    quiet = random.Random(1)  # noqa: S311
    records = [
        (o, _chunk(quiet, name, _unpacked(b)[1], is_honest=True) if o == Opcode.CHUNK else b)
        for o, b in structured.mcap_records(valid)
    ]
    return _joined(records)


def _joined(records: Sequence[tuple[int, bytes]]) -> bytes:
    magic = b"\x89MCAP0\r\n"
    return magic + b"".join(_RECORD.pack(o, len(b)) + b for o, b in records)


def _unpacked(chunk: bytes) -> tuple[bytes, bytes]:
    """Return the name of its compression, and the records of a chunk."""
    *_, length = _CHUNK.unpack_from(chunk)
    name, packed = chunk[_CHUNK.size : _CHUNK.size + length], chunk[_CHUNK.size + length + 8 :]
    if name == b"zstd":
        return name, zstandard.ZstdDecompressor().decompress(packed)
    return name, lz4.frame.decompress(packed) if name == b"lz4" else packed


def _chunk(rng: random.Random, name: bytes, inside: bytes, *, is_honest: bool = False) -> bytes:
    """Return a chunk of these records; its claims are now and then wrong."""
    kind = name if is_honest or rng.random() < 0.6 else rng.choice((b"", b"lz4", b"zstd", b"zip"))
    packers: dict[bytes, Callable[[bytes], bytes]] = {
        b"zstd": zstandard.ZstdCompressor(level=1).compress,
        b"lz4": lz4.frame.compress,
    }
    packed = packers.get(kind, bytes)(inside)
    size, checksum, stored = len(inside), zlib.crc32(inside), len(packed)
    if not is_honest:
        wrong = rng.randrange(40)
        size = {0: size // 2, 1: 65 << 20, 2: size + 7}.get(wrong, size)
        checksum = {3: checksum ^ 1, 4: 0, 5: 0}.get(wrong, checksum)
        stored = {6: stored + 1}.get(wrong, stored)
        packed = {7: mutate.raw(rng, packed), 8: b"", 9: packed[:-2]}.get(wrong, packed)
        stored = len(packed) if wrong in (7, 8, 9) else stored
        kind = b"lzma" if wrong == 10 else kind
    head = _CHUNK.pack(1, 2, size, checksum, len(kind)) + kind
    return head + struct.pack("<Q", stored) + packed


def _inside(rng: random.Random, inside: bytes) -> bytes:
    """Change one record inside a chunk."""
    records = structured.mcap_records(bytes(8) + inside + bytes(8))
    if not records:
        return inside
    at = rng.randrange(len(records))
    opcode, body = records[at]
    match rng.randrange(12):
        case 0:
            del records[at]
        case 1:
            records.insert(at, records[rng.randrange(len(records))])
        case 2:
            records[at] = (rng.choice((1, 2, 3, 4, 5, 6, 7, 15, 0x80)), body)
        case 3:
            return b"".join(_RECORD.pack(o, len(b) + 1) + b for o, b in records)
        case _:
            records[at] = (opcode, _body(rng, body))
    return b"".join(_RECORD.pack(o, len(b)) + b for o, b in records)


def _body(rng: random.Random, body: bytes) -> bytes:
    """Change a message: its facts, the sides of its picture, or its bytes."""
    at = body.find(b'{"')
    if at < 0 or rng.random() < 0.2:
        return _sides(rng, body)
    try:
        facts = json.loads(body[at:])
    except ValueError:
        return mutate.raw(rng, body)
    if isinstance(facts, dict) and "frames" in facts and rng.random() < 0.6:
        return body[:at] + json.dumps(_facts(rng, facts)).encode()
    return body[:at] + mutate.as_json(rng, facts).encode(errors="replace")


def _facts(rng: random.Random, facts: dict[str, Any]) -> dict[str, Any]:
    """Change what is told of a multi-view to something that its schema allows."""
    frames: list[dict[str, Any]] = facts["frames"]
    frame = rng.choice(frames)
    match rng.randrange(6):
        case 0:
            frame["bits"] = rng.choice(_FOUND_BITS)
        case 1:
            frame["timestamp_s"] = rng.choice((0.0, 1e9, frame["timestamp_s"] + 59.0))
        case 2:
            frame["view"] = rng.choice((frames[0]["view"], "other", ""))
        case 3:
            frames.reverse()
        case 4:
            frames.append(dict(frame))
        case _:
            frames.remove(frame)
    return facts


def _sides(rng: random.Random, body: bytes) -> bytes:
    """Swap the sides or the coding of a picture (protobuf: a key, then a small number)."""
    if rng.random() < 0.5 or len(body) < 30:
        return mutate.raw(rng, body) if body else b"x"
    for one, other in ((b"mono8", b"mono1"), (b"mono16", b"mono32"), (b"rgb8", b"bgr8")):
        if one in body and rng.random() < 0.3:
            return body.replace(one, other)
    sides = {6, 9}
    places = [at for at in range(22, min(len(body), 120)) if body[at] in sides]
    changed_body = bytearray(body)
    for at in places:
        changed_body[at] = rng.choice((6, 9, 2, 3, 18))
    return bytes(changed_body)
