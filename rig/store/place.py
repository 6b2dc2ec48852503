"""An empty place for a store, and how its database comes there: last, and in one step."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rig.database.location import Location
from rig.database.store import open_at, store_at
from rig.disk import disk_explained
from rig.errors import StoreError
from rig.files import make_folder, sync_file, sync_folder
from rig.store.layout import MARK, entries

_BESIDE = ("", "-wal", "-shm", "-journal")
"""What SQLite puts beside a file, and the file."""


def require_outside(folder: Path, frames: Path, doing: str) -> None:
    """Refuse a folder below the frames themselves: it would be taken for some.

    Raises:
        StoreError: it is there.
    """
    if folder.absolute().is_relative_to(frames.absolute()):
        raise StoreError(
            f"asked to {doing} into {folder}, it is inside of the frames, {frames}",
            advice="choose a folder outside",
        )


def require_empty(location: Location, mark: str) -> None:
    """Refuse a place where something is.

    Args:
        location: the place.
        mark: what stands in `MARK` where the same work was cut short; that may go on.

    Raises:
        StoreError: a database or frames are there.
    """
    require_no_rows(location)
    require_empty_frames(location, mark)


def require_no_rows(location: Location) -> None:
    """Refuse a place where a database is.

    Raises:
        StoreError: it holds rows; of SQLite, it is there at all.
    """
    file = location.file
    if file is None:
        with open_at(location) as store:
            if not store.is_empty():
                raise _occupied(location, "a database with rows in it")
    else:
        beside = [file.with_name(f"{file.name}{ending}") for ending in _BESIDE]
        found = [path for path in beside if path.exists() and path.stat().st_size > 0]
        if found:
            raise _occupied(location, f"{found[0]} there")


def require_empty_frames(location: Location, mark: str) -> None:
    """Refuse a place where frames are; see `require_empty`.

    Raises:
        StoreError: they are.
    """
    names = [path.name for path in entries(location.frames)]
    if MARK in names:
        with disk_explained("read", location.frames / MARK):
            before = (location.frames / MARK).read_text(encoding="utf-8", errors="replace")
        if before != mark:
            raise _occupied(location, f"the unfinished work {before[:200]} in {location.frames}")
    elif names:
        raise _occupied(location, f"{names[0]} in {location.frames}")


def _occupied(location: Location, found: str) -> StoreError:
    return StoreError(
        f"{location}: asked for an empty place, found {found}",
        advice="choose another with --db and RIG_FRAMES, or move away what is there",
    )


@contextmanager
def scratch(location: Location) -> Generator[Path]:
    """Give a name for a database on its way to a location; nothing is left of it at the end.

    Args:
        location: where it is to go; on the same disk, so that one step puts it there.
    """
    folder = location.frames if location.file is None else location.file.parent
    name = "rows" if location.file is None else location.file.name
    path = folder / f".{name}.arriving.tmp"
    with disk_explained("write the database", path):
        make_folder(folder, location.modes.folder)
        _clear(path)
        try:
            yield path
        finally:
            _clear(path)


def put_rows(file: Path, location: Location) -> None:
    """Put a database in its place: all of it, or nothing.

    Args:
        file: of `scratch`; nobody has it open.
        location: an empty place.

    Raises:
        StoreError: the place is not empty any more, or cannot be written.
    """
    if location.file is None:
        with store_at(file, location.frames, location.modes) as rows, open_at(location) as there:
            rows.copy_into(there)
        return
    with disk_explained("write the database", location.file):
        file.chmod(location.modes.file)
        sync_file(file)
        file.replace(location.file)
        sync_folder(location.file.parent)


def _clear(file: Path) -> None:
    for ending in _BESIDE:
        file.with_name(f"{file.name}{ending}").unlink(missing_ok=True)


def remove_database(file: Path) -> None:
    """Remove a SQLite file and what is beside it; the file first, so that none is half there.

    Raises:
        OSError: it may not be removed.
    """
    _clear(file)
    sync_folder(file.parent)
