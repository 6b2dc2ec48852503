"""What goes wrong with disks, in one line with a way out."""

import errno
from collections.abc import Generator
from contextlib import contextmanager

from rig.errors import StoreError

FULL = ("the disk is full (or a size limit is reached)", "free space, then try again")
READ_ONLY = ("it may only be read", "check permissions, or choose another place with --db")

_OF_SYSTEM = {
    errno.ENOSPC: FULL,
    errno.EDQUOT: FULL,
    errno.EFBIG: FULL,
    errno.EROFS: READ_ONLY,
    errno.EACCES: READ_ONLY,
    errno.EPERM: READ_ONLY,
    errno.ELOOP: ("a symbolic link is at its place", "remove the link"),
}


@contextmanager
def disk_explained(doing: str, place: object) -> Generator[None]:
    """Turn errors of the system into one `StoreError`.

    Args:
        doing: what was asked, to follow "cannot".
        place: file or folder.

    Raises:
        StoreError: instead of `OSError`.
    """
    try:
        yield
    except OSError as error:
        unknown = (error.strerror or str(error), "check this path")
        found, advice = _OF_SYSTEM.get(error.errno or 0, unknown)
        raise StoreError(f"{place}: cannot {doing}: {found}", advice=advice) from error
