"""Files that appear whole or not at all."""

import os
from contextlib import suppress
from pathlib import Path

from rig.errors import StoreError


def put_in_place(path: Path, content: bytes) -> None:
    """Write a file through a temporary one beside it, which then takes its name.

    A reader, and a program that is killed here, sees the old file or the new one.

    Raises:
        OSError: it cannot be written; an older file of this name is as it was.
    """
    _put(path, content, survives_power_cut=False)


def put_on_disk(path: Path, content: bytes) -> None:
    """Put a file in place that survives a power cut from then on; see `put_in_place`.

    Raises:
        OSError: it cannot be written; an older file of this name is as it was.
    """
    _put(path, content, survives_power_cut=True)


def _put(path: Path, content: bytes, *, survives_power_cut: bool) -> None:
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("wb") as file:
            file.write(content)
            if survives_power_cut:
                file.flush()
                os.fsync(file.fileno())
        beside.replace(path)
    finally:
        with suppress(OSError):  # gone if it took the name; else the first error is the one
            beside.unlink()


def write_bytes(path: Path, content: bytes) -> None:
    """Put a file in place; see `put_in_place`.

    Raises:
        StoreError: the folder is missing or read-only, or the disk is full; an older file of this
            name is as it was.
    """
    try:
        put_in_place(path, content)
    except OSError as error:
        raise StoreError(
            f"{path}: {len(content)} bytes cannot be written: {error.strerror}",
            advice="make room or choose another folder",
        ) from error


def read_bytes(path: Path, most: int | None = None) -> bytes:
    """Read a whole file.

    Args:
        path: file to read.
        most: stop after one byte more than that; None reads all.

    Raises:
        StoreError: it is missing or cannot be read.
    """
    try:
        with path.open("rb") as file:
            return file.read() if most is None else file.read(most + 1)
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be read: {error.strerror}", advice="check the path"
        ) from error
