"""Files that appear whole or not at all."""

import errno
import os
from contextlib import suppress
from itertools import chain, count
from pathlib import Path

from rig.errors import StoreError


def put_in_place(path: Path, content: bytes) -> None:
    """Write a file through a temporary one beside it, which then takes its name.

    A reader, and a program that is killed here, sees the old file or the new one.

    Raises:
        OSError: it cannot be written; an older file of this name is as it was.
    """
    _put(path, content, survives_power_cut=False)


def put_on_disk(path: Path, content: bytes, mode: int | None = None) -> None:
    """Put a file in place that survives a power cut from then on; see `put_in_place`.

    Args:
        path: of the file.
        content: all of it.
        mode: permission bits of the file; None for those of the user's umask.

    Raises:
        OSError: it cannot be written; an older file of this name is as it was.
    """
    _put(path, content, survives_power_cut=True, mode=mode)
    sync_folder(path.parent)


def make_folder(folder: Path, mode: int) -> None:
    """Make a folder and what it is in; all of them survive a power cut.

    Args:
        folder: is there afterwards; one that was there before is left as it is.
        mode: permission bits of every new one.

    Raises:
        OSError: it cannot be made.
    """
    if folder.is_dir():
        return
    make_folder(folder.parent, mode)
    with suppress(FileExistsError):  # another program was quicker
        folder.mkdir()
        folder.chmod(mode)  # mkdir takes the umask off
        sync_folder(folder.parent)
    if not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))


def unused(folder: Path) -> Path:
    """Return a name that nothing has yet: that of a folder, or with `-2`, `-3`, ... behind it.

    A time in a name does not make it unique: what was killed and begun again within the same
    second, or after the clock was set back, would meet what the first one left.
    """
    named = (folder.with_name(f"{folder.name}-{number}") for number in count(2))
    return next(path for path in chain((folder,), named) if not os.path.lexists(path))


def make_new_folder(folder: Path, mode: int) -> Path:
    """Make a folder that was not there before, and what it is in; see `make_folder`.

    Args:
        folder: how it should be named.
        mode: permission bits of every new one.

    Returns:
        The folder, named by `unused`; of several programs each gets one of its own.

    Raises:
        OSError: it cannot be made.
    """
    make_folder(folder.parent, mode)
    while True:
        made = unused(folder)
        with suppress(FileExistsError):  # another program was quicker: the next name
            made.mkdir()
            made.chmod(mode)
            sync_folder(made.parent)
            return made


def sync_file(file: Path) -> None:
    """Make what was written into a file survive a power cut.

    Raises:
        OSError: the file is gone, or the disk fails.
    """
    with file.open("r+b") as opened:
        os.fsync(opened.fileno())


def no_link(path: str, flags: int) -> int:
    """Open a file to write, for the `opener` of `open`; a symbolic link at its place is refused.

    What an output folder holds may come from somebody else; a link in it must not lead out.

    Raises:
        OSError: it cannot be opened, or is a link.
    """
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)


def sync_folder(folder: Path) -> None:
    """Make names in a folder survive a power cut; Windows has no such call and needs none.

    Raises:
        OSError: the folder is gone, or the disk fails.
    """
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that knows no such thing
            raise
    finally:
        os.close(handle)


def _put(path: Path, content: bytes, *, survives_power_cut: bool, mode: int | None = None) -> None:
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("wb") as file:
            if mode is not None:
                beside.chmod(mode)
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
