"""MCAP files with an index, whose writing needs the same memory however long they get.

Each call writes one chunk, uncompressed, and its message indexes. The index of the whole file is
made at closing, from what the file itself holds: nothing is kept per chunk. A write that fails
leaves the file as it was before; one that is killed leaves one unfinished chunk at the end.
"""

import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from rig.errors import StoreError
from rig.folder_lock import FolderLock

MAGIC: Final = b"\x89MCAP0\r\n"
RECORD: Final = struct.Struct("<BQ")
"""Opcode and length of what follows."""
MESSAGE: Final = struct.Struct("<HIQQ")
"""Channel, sequence number, log time and publish time; the data follow."""
CHUNK: Final = struct.Struct("<QQQIIQ")
"""First and last time, size and checksum of the records, no name of a compression, stored size."""
_INDEX: Final = struct.Struct("<BQHIQQ")
"""Message index with one entry: record, channel, size of the entries, time and offset."""
_MOST_PIECES: Final = 512
"""Buffers that one call of the system takes."""

Payload = Sequence[bytes | memoryview]
"""The bytes of one message, in pieces."""


class McapWriter:
    """Writes a new MCAP file.

    Args:
        path: must not exist.
        profile: what the header calls the contents.
        has_checksums: whether chunks carry one; it costs a third of a millisecond for a megabyte.

    Raises:
        OwnedError: another program is writing this file.
        StoreError: the file exists or cannot be written.
    """

    def __init__(self, path: Path, profile: str, *, has_checksums: bool = True) -> None:
        self._path = path
        self._has_checksums = has_checksums
        try:
            self._file = path.open("xb+", buffering=0)
        except FileExistsError as error:
            FolderLock.beside(path).release()  # names the program that is writing it, if one is
            raise StoreError(
                f"{path}: exists already", advice="name another file or remove it"
            ) from error
        except OSError as error:
            raise StoreError(
                f"{path}: cannot be written: {error.strerror}", advice="choose another place"
            ) from error
        try:
            self._lock = FolderLock.beside(path)
        except StoreError:
            self._file.close()
            path.unlink()
            raise
        self._end = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._chunks = 0
        self._span_ns: tuple[int, int] | None = None
        try:
            self._append([MAGIC, _packed(Header(profile, "rig"))])
        except StoreError:
            self._file.close()
            path.unlink()
            self._lock.release()
            raise

    @property
    def chunks(self) -> int:
        """How many chunks were written."""
        return self._chunks

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Write a schema; return its number."""
        schema = Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name)
        self._schemas.append(schema)
        self._append([_packed(schema)])
        return schema.id

    def add_channel(
        self, topic: str, encoding: str, schema: int, metadata: Mapping[str, str] | None = None
    ) -> int:
        """Write a channel of messages of a schema; return its number."""
        number = len(self._channels) + 1
        channel = Channel(
            id=number,
            topic=topic,
            message_encoding=encoding,
            metadata=dict(metadata or {}),
            schema_id=schema,
        )
        self._channels.append(channel)
        self._append([_packed(channel)])
        return number

    def add_metadata(self, name: str, content: Mapping[str, str]) -> None:
        """Write a table of words."""
        record = _packed(Metadata(name=name, metadata=dict(content)))
        self._metadata.append(MetadataIndex(offset=self._end, length=len(record), name=name))
        self._append([record])

    def write(self, messages: Sequence[tuple[int, Payload]], time_ns: int) -> None:
        """Write one chunk.

        Args:
            messages: number of the channel and bytes of each.
            time_ns: of all of them, since 1970-01-01 UTC.

        Raises:
            StoreError: the disk is full or gone; the file holds what it held before.
        """
        pieces: list[bytes | memoryview] = []
        indexes: list[bytes] = []
        size = checksum = 0
        for channel, payload in messages:
            length = MESSAGE.size + sum(len(piece) for piece in payload)
            head = RECORD.pack(Opcode.MESSAGE, length)
            head += MESSAGE.pack(channel, self._chunks, time_ns, time_ns)
            indexes.append(_INDEX.pack(Opcode.MESSAGE_INDEX, 22, channel, 16, time_ns, size))
            for piece in (head, *payload):
                if self._has_checksums:  # else 0, which stands for none
                    checksum = zlib.crc32(piece, checksum)
                pieces.append(piece)
            size += RECORD.size + length
        chunk = RECORD.pack(Opcode.CHUNK, CHUNK.size + size)
        chunk += CHUNK.pack(time_ns, time_ns, size, checksum, 0, size)
        self._append([chunk, *pieces, *indexes])
        self._chunks += 1
        self._counts.update(channel for channel, _ in messages)
        first_ns, last_ns = self._span_ns or (time_ns, time_ns)
        self._span_ns = min(first_ns, time_ns), max(last_ns, time_ns)

    def close(self) -> None:
        """Write the index of the whole file and close it; safe to call again.

        Raises:
            StoreError: the index cannot be written; what was written before is whole.
        """
        if self._file.closed:
            return
        try:
            self._finish()
        finally:
            self._file.close()
            self._lock.release()

    def _finish(self) -> None:
        data_end = self._end
        self._append([_packed(DataEnd(0))])
        start, checksum = self._end, 0
        offsets: list[SummaryOffset] = []
        groups: list[tuple[Opcode, Callable[[], Iterator[McapRecord]]]] = [
            (Opcode.SCHEMA, lambda: iter(self._schemas)),
            (Opcode.CHANNEL, lambda: iter(self._channels)),
            (Opcode.STATISTICS, lambda: iter([self._statistics()])),
            (Opcode.CHUNK_INDEX, lambda: self._chunk_indexes(data_end)),
            (Opcode.METADATA_INDEX, lambda: iter(self._metadata)),
        ]
        for opcode, records in groups:
            begun = self._end
            for record in records():
                checksum = self._append_checked(record, checksum)
            if self._end > begun:
                offset = SummaryOffset(
                    group_opcode=opcode, group_start=begun, group_length=self._end - begun
                )
                offsets.append(offset)
        offset_start = self._end
        for offset in offsets:
            checksum = self._append_checked(offset, checksum)
        head = RECORD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", start, offset_start)
        footer = Footer(
            summary_start=start,
            summary_offset_start=offset_start,
            summary_crc=zlib.crc32(head, checksum),
        )
        self._append([_packed(footer), MAGIC])

    def _statistics(self) -> Statistics:
        first_ns, last_ns = self._span_ns or (0, 0)
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=self._chunks,
            message_count=self._counts.total(),
            message_end_time=last_ns,
            message_start_time=first_ns,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _chunk_indexes(self, end: int) -> Iterator[ChunkIndex]:
        """Read back where each chunk and its message indexes lie."""
        handle, start = self._file.fileno(), len(MAGIC)
        while start < end:
            head = os.pread(handle, RECORD.size + CHUNK.size, start)
            opcode, length = RECORD.unpack_from(head)
            behind = start + RECORD.size + length
            if opcode == Opcode.CHUNK:
                first_ns, last_ns, size, _, _, _ = CHUNK.unpack_from(head, RECORD.size)
                offsets = self._message_indexes(behind)
                yield ChunkIndex(
                    chunk_length=behind - start,
                    chunk_start_offset=start,
                    compression="",
                    compressed_size=size,
                    message_end_time=last_ns,
                    message_index_length=_INDEX.size * len(offsets),
                    message_index_offsets=offsets,
                    message_start_time=first_ns,
                    uncompressed_size=size,
                )
                behind += _INDEX.size * len(offsets)
            start = behind

    def _message_indexes(self, start: int) -> dict[int, int]:
        """Return where the message indexes lie that begin at a place, by channel."""
        block = os.pread(self._file.fileno(), _INDEX.size * len(self._channels), start)
        offsets: dict[int, int] = {}
        for at in range(0, len(block) - _INDEX.size + 1, _INDEX.size):
            opcode, _, channel, _, _, _ = _INDEX.unpack_from(block, at)
            if opcode != Opcode.MESSAGE_INDEX:
                break
            offsets[channel] = start + at
        return offsets

    def _append_checked(self, record: McapRecord, checksum: int) -> int:
        packed = _packed(record)
        self._append([packed])
        return zlib.crc32(packed, checksum)

    def _append(self, pieces: Sequence[bytes | memoryview]) -> None:
        """Write at the end, all or nothing."""
        try:
            written = _write_all(self._file.fileno(), pieces)
        except OSError as error:
            os.ftruncate(self._file.fileno(), self._end)
            os.lseek(self._file.fileno(), self._end, os.SEEK_SET)
            raise StoreError(
                f"{self._path}: cannot be written: {error.strerror}", advice="is the disk full?"
            ) from error
        self._end += written


def _packed(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _write_all(handle: int, pieces: Sequence[bytes | memoryview]) -> int:
    """Write buffers one behind the other without copying them; return how many bytes."""
    left = [memoryview(piece).cast("B") for piece in pieces if len(piece)]
    total = 0
    while left:
        written = os.writev(handle, left[:_MOST_PIECES])
        total += written
        while left and written >= len(left[0]):
            written -= len(left.pop(0))
        if written:
            left[0] = left[0][written:]
    return total
