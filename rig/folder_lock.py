"""One program per folder of frames: a lock beside the frames that says who holds it.

    with FolderLock(folder):
        ...

The system lets go of the lock when its program ends, however it ends (flock(2)); the file then
tells who that was, and the next one takes it over.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO, Self

from rig.disk import disk_explained
from rig.errors import StoreError
from rig.owner import Owner, owned

LOCK_FILE = ".owner.json"
_FAR_BYTE = 1 << 30
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
"""A link in a folder from elsewhere would have the file it leads to emptied."""
_TRIES = 100
"""So often a lock may be let go of between opening and locking it."""


class FolderLock:
    """The lock of one folder; a context manager, held from its making.

    Args:
        folder: is there.
        name: of the file; another than the folder's own for one file in it, see `beside`.
        owner: of the lease that goes with it; None for a new ownership.
        mode: of the file.

    Raises:
        OwnedError: another program holds it; names that one. Nothing was changed.
        StoreError: the folder is gone, or may only be read.
    """

    def __init__(
        self,
        folder: Path,
        *,
        name: str = LOCK_FILE,
        owner: Owner | None = None,
        mode: int = 0o600,
    ) -> None:
        self._folder = folder
        self._path = folder / name
        with disk_explained("take hold of the folder", folder):
            self._file = self._taken(mode)
            try:
                self._path.chmod(mode)  # the umask may have taken some off
                self._file.truncate(0)
                self._file.write((owner or Owner.this_program()).to_json().encode() + b"\n")
                self._file.flush()
            except BaseException:
                self.release()
                raise

    @classmethod
    def beside(cls, file: Path) -> "FolderLock":
        """Take hold of one file, by a lock beside it.

        Raises:
            OwnedError: another program holds it.
            StoreError: its folder is gone, or may only be read.
        """
        return cls(file.parent, name=f".{file.name}{LOCK_FILE}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def require(self) -> None:
        """Make sure that the folder is still the one that was taken hold of.

        Raises:
            StoreError: it is gone, or another one is at its place.
        """
        if not self._is_in_place(self._file):
            raise StoreError(
                f"{self._folder}: the folder is gone, or another one is at its place (unmounted, "
                "deleted, network share lost)",
                advice="bring it back and go on with --resume; what was stored is in it",
            )

    def release(self) -> None:
        """Let go; safe any number of times, also when the folder is gone."""
        if self._file.closed:
            return
        with suppress(OSError):  # a lost share has nothing to remove
            if self._is_in_place(self._file):
                self._path.unlink()
        with suppress(OSError):
            self._file.close()

    def _taken(self, mode: int) -> IO[bytes]:
        for _ in range(_TRIES):
            file = os.fdopen(os.open(self._path, os.O_RDWR | os.O_CREAT | _NO_LINK, mode), "r+b")
            try:
                _lock(file)
            except BlockingIOError:
                with file:
                    holder = self._holder(file)
                raise owned(f"asked for {self._folder}", holder) from None
            except BaseException:
                file.close()
                raise
            if self._is_in_place(file):
                return file
            file.close()  # who held it removed the file in between
        raise owned(f"asked for {self._folder}", "programs that take turns")

    def _holder(self, file: IO[bytes]) -> str:
        text = file.read().decode(errors="replace").strip()
        return str(owner) if (owner := Owner.from_json(text)) else "another program"

    def _is_in_place(self, file: IO[bytes]) -> bool:
        try:
            there, held = self._path.stat(), os.fstat(file.fileno())
        except OSError:
            return False
        return (there.st_dev, there.st_ino) == (held.st_dev, held.st_ino)


if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes]) -> None:
        file.seek(_FAR_BYTE)  # what is locked there cannot be read, and the content should be
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError from error
        finally:
            file.seek(0)

else:
    import fcntl

    def _lock(file: IO[bytes]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
