"""Changes of files of parts or records, whose lengths and checksums are right again."""

import random
import struct
import zlib
from collections.abc import Callable

from benchmarks.fuzz import mutate


def png(rng: random.Random, valid: bytes) -> bytes:
    """Change parts of a PNG; their checksums are right again in most cases."""
    parts = _png_parts(valid)
    at = rng.randrange(len(parts))
    name, body = parts[at]
    match rng.randrange(10):
        case 0:
            del parts[at]
        case 1:
            parts.insert(at, parts[rng.randrange(len(parts))])
        case 8:
            head = bytearray(parts[0][1])
            place = rng.randrange(8, len(head)) if rng.random() < 0.5 else rng.randrange(8)
            head[place] = rng.choice((0, 1, 2, 3, 4, 6, 8, 16))
            parts[0] = (parts[0][0], bytes(head))
        case 9:
            parts.insert(1, (b"PLTE", bytes(rng.choice((0, 2, 3, 6, 12, 48, 768, 771)))))
        case 2:
            parts[at] = (bytes(rng.choice(b"IHDRPLTEtRNSacTLfdAT") for _ in range(4)), body)
        case 3:
            parts.insert(1, (rng.choice((b"zTXt", b"iCCP", b"acTL", b"PLTE", b"tRNS")), body[:600]))
        case 4:
            pixels = zlib.decompress(b"".join(body for name, body in parts if name == b"IDAT"))
            parts = [part for part in parts if part[0] != b"IDAT"]
            parts.insert(-1, (b"IDAT", zlib.compress(mutate.raw(rng, pixels))))
        case _:
            parts[at] = (name, mutate.raw(rng, body) if body else b"x")
    joined = valid[:8] + b"".join(png_part(*part) for part in parts)
    return mutate.raw(rng, joined) if rng.random() < 0.1 else joined


def _png_parts(valid: bytes) -> list[tuple[bytes, bytes]]:
    at, found = 8, list[tuple[bytes, bytes]]()
    while at < len(valid):
        length, name = struct.unpack_from(">I4s", valid, at)
        found.append((name, valid[at + 8 : at + 8 + length]))
        at += 12 + length
    return found


def png_part(name: bytes, body: bytes) -> bytes:
    """Return a part with its length and checksum."""
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))


_MCAP_HEAD = struct.Struct("<BQ")


def mcap(
    rng: random.Random, valid: bytes, change: Callable[[random.Random, bytes], bytes]
) -> bytes:
    """Change records of an MCAP file; their lengths are right again in most cases."""
    records = mcap_records(valid)
    at = rng.randrange(len(records))
    opcode, body = records[at]
    match rng.randrange(8):
        case 0:
            del records[at]
        case 1:
            records.insert(at, records[rng.randrange(len(records))])
        case 2:
            records[at] = (rng.randrange(16), body)
        case _:
            records[at] = (opcode, change(rng, body))
    joined = valid[:8] + b"".join(_MCAP_HEAD.pack(o, len(b)) + b for o, b in records) + valid[:8]
    return mutate.raw(rng, joined) if rng.random() < 0.1 else joined


def mcap_records(valid: bytes) -> list[tuple[int, bytes]]:
    """Return opcode and content of every record between the magic bytes."""
    at, found = 8, list[tuple[int, bytes]]()
    while at + _MCAP_HEAD.size <= len(valid) - 8:
        opcode, length = _MCAP_HEAD.unpack_from(valid, at)
        at += _MCAP_HEAD.size
        found.append((opcode, valid[at : at + length]))
        at += length
    return found
