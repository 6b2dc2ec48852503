"""Messages of an MCAP file, in the order that they were written, from any file whatsoever.

Nothing that a file claims is believed before it is compared with the file's own size and with
limits, so that a damaged or hostile file costs neither time nor memory. A file that was cut off
ends with its last whole record.
"""

import io
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from rig.errors import StoreError
from rig.recording.mcap_writer import MAGIC, MESSAGE, RECORD

_LARGEST_RECORD: Final = 1 << 30
"""A multi-view of 40 views of 12 Mpx and 16 bit fits."""
_LARGEST_UNPACKED: Final = 64 << 20
"""Most that a compressed chunk may hold; the writer of old recordings compressed one picture a
chunk."""
_CHUNK_HEAD: Final = struct.Struct("<QQQII")
_ENDINGS: Final = (Opcode.DATA_END, Opcode.FOOTER)
_TOLD: Final = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
"""What a chunk may hold, and what matters outside of one."""


@dataclass(frozen=True, slots=True)
class StoredMessage:
    """One message as it is stored."""

    topic: str
    encoding: str
    """Of the data: `json`, `protobuf`, `cdr`."""
    schema: str
    """Name of its schema."""
    data: memoryview


class McapReader:
    """Reads one open file.

    Args:
        file: at its beginning.
        path: for messages.
    """

    def __init__(self, file: IO[bytes], path: Path) -> None:
        self._file = file
        self._path = path
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}

    def messages(self) -> Iterator[StoredMessage]:
        """Yield every whole message.

        Raises:
            StoreError: it is no MCAP file, or is damaged.
        """
        self._require_magic()
        for opcode, content in self._records():
            try:
                if opcode == Opcode.CHUNK:
                    yield from self._of_chunk(content)
                else:
                    yield from self._of_record(opcode, content)
            except (McapError, struct.error, ValueError, OverflowError, KeyError) as error:
                raise self._damaged(f"{type(error).__name__} {error}".strip()) from error

    def _require_magic(self) -> None:
        found = self._file.read(len(MAGIC))
        if found != MAGIC:
            what = "is empty" if not found else "is no MCAP file, or damaged"
            raise StoreError(
                f"{self._path}: {what}", advice="name a file of `rig capture --record`"
            )

    def _records(self) -> Iterator[tuple[int, memoryview]]:
        """Yield the records that hold messages or tell what they are, up to the last whole one."""
        left = os.fstat(self._file.fileno()).st_size - len(MAGIC)
        while len(head := self._file.read(RECORD.size)) == RECORD.size:
            opcode, length = RECORD.unpack(head)
            left -= RECORD.size
            if opcode == 0 or length > _LARGEST_RECORD:
                raise self._damaged(
                    f"a record {opcode} of {length} bytes, largest are {_LARGEST_RECORD}"
                )
            if opcode in _ENDINGS or length > left:
                return
            left -= length
            if opcode in (*_TOLD, Opcode.CHUNK):
                yield opcode, memoryview(self._file.read(length))
            else:
                self._file.seek(length, os.SEEK_CUR)

    def _of_chunk(self, content: memoryview) -> Iterator[StoredMessage]:
        records = self._unpacked(content)
        at = 0
        while at < len(records):
            opcode, length = RECORD.unpack_from(records, at)
            at += RECORD.size
            if opcode not in _TOLD or length > len(records) - at:
                raise self._damaged(
                    f"a record {opcode} of {length} bytes where {len(records) - at} are"
                )
            yield from self._of_record(opcode, records[at : at + length])
            at += length

    def _of_record(self, opcode: int, content: memoryview) -> Iterator[StoredMessage]:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(_stream(content))
            self._schemas[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(_stream(content))
            self._channels[channel.id] = channel
        else:  # of those that are told, only a message is left
            number, *_ = MESSAGE.unpack_from(content)
            channel = self._channels[number]
            schema = self._schemas.get(channel.schema_id, "")
            encoding = channel.message_encoding
            # A copy, which does not keep the whole chunk around it alive.
            data = memoryview(bytes(content[MESSAGE.size :]))
            yield StoredMessage(channel.topic, encoding, schema, data)

    def _unpacked(self, content: memoryview) -> memoryview:
        """Return the records of a chunk."""
        _, _, size, checksum, length = _CHUNK_HEAD.unpack_from(content)
        at = _CHUNK_HEAD.size + length
        compression = bytes(content[_CHUNK_HEAD.size : at])
        (stored,) = struct.unpack_from("<Q", content, at)
        packed = content[at + 8 :]
        if stored != len(packed):
            raise self._damaged(f"a chunk of {stored} bytes where {len(packed)} are")
        if compression == b"":
            records = packed
        elif size > _LARGEST_UNPACKED:
            raise self._damaged(
                f"a chunk that unpacks to {size} bytes, most are {_LARGEST_UNPACKED}"
            )
        else:
            records = memoryview(self._decompressed(compression, packed, size))
        if size != len(records) or (checksum and zlib.crc32(records) != checksum):
            raise self._damaged("checksum or size of a chunk is wrong")
        return records

    def _decompressed(self, compression: bytes, packed: memoryview, size: int) -> bytes:
        unpacker: Any
        try:
            if compression == b"zstd":
                claimed = zstandard.frame_content_size(packed)
                if claimed > size:
                    raise self._damaged(f"a chunk of {size} bytes that unpacks to {claimed}")
                unpacker = zstandard.ZstdDecompressor()
                return unpacker.decompress(packed, max_output_size=size)
            if compression == b"lz4":
                unpacker = lz4.frame.LZ4FrameDecompressor()
                return unpacker.decompress(bytes(packed), max_length=size)
        except (zstandard.ZstdError, RuntimeError, EOFError) as error:
            raise self._damaged(str(error)) from error
        raise self._damaged(f"compression {compression[:20]!r} is not known")

    def _damaged(self, what: str) -> StoreError:
        return StoreError(f"{self._path}: is damaged: {what}", advice="record it again")


def _stream(content: memoryview) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(content))
