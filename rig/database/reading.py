"""A SQLite file on a disk that may only be read: a share, a backup, another user's store."""

import os
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, create_engine, event
from sqlalchemy.pool import NullPool, StaticPool

from rig.database.location import Location
from rig.database.schema import REVISIONS, migrate, revision
from rig.database.trouble import explained
from rig.errors import StoreError


def may_only_be_read(location: Location) -> bool:
    """Tell whether there is a SQLite file that this program may read and not write."""
    file = location.file
    if file is None or not file.is_file() or file.stat().st_size == 0:
        return False
    return _may(file, os.R_OK) and not (_may(file, os.W_OK) and _may(file.parent, os.W_OK))


def open_to_read(location: Location) -> Engine:
    """Open a SQLite file that may only be read; an old one is upgraded in memory.

    Raises:
        StoreError: it is not ours, is newer than this program, or what was written last is in a
            file beside it that cannot be read without writing.
    """
    file = location.file
    if file is None:
        raise StoreError(f"{location}: is no file", advice="choose another with --db")
    with explained("open the database", location):
        uri = _uri(file, location)

        def connect() -> sqlite3.Connection:
            return sqlite3.connect(uri, uri=True, check_same_thread=False)

        engine = create_engine("sqlite://", creator=connect, poolclass=NullPool)
        event.listen(engine, "connect", _prepare)
        with engine.connect() as connection:
            found = revision(connection, location)
        if found == REVISIONS[-1]:
            return engine
        engine.dispose()
        return _in_memory(uri)


def _uri(file: Path, location: Location) -> str:
    """Return how to open it: as it is, or, where nobody can be writing, as one that stays so."""
    address = f"{file.as_uri()}?mode=ro"
    try:
        with closing(sqlite3.connect(address, uri=True)) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master")
    except sqlite3.OperationalError:
        log = file.with_name(f"{file.name}-wal")
        if log.is_file() and log.stat().st_size > 0:
            raise StoreError(
                f"{location}: asked to read the database, what was written last is still in "
                f"{log.name}, which takes write access to be read",
                advice="copy both files to a place that you may write to, and read them there",
            ) from None
        return f"{address}&immutable=1"
    return address


def _in_memory(uri: str) -> Engine:
    """Return an engine for an upgraded copy; numbers only, frames are beside the file."""
    copy = sqlite3.connect(":memory:", check_same_thread=False)
    with closing(sqlite3.connect(uri, uri=True)) as original:
        original.backup(copy)
    engine = create_engine("sqlite://", creator=lambda: copy, poolclass=StaticPool)
    event.listen(engine, "connect", _prepare)
    with engine.begin() as connection:
        migrate(connection)
    copy.execute("PRAGMA query_only = ON")
    return engine


def _prepare(connection: Any, _: object) -> None:
    connection.isolation_level = None


def _may(path: Path, how: int) -> bool:
    effective = os.access in os.supports_effective_ids
    return os.access(path, how, effective_ids=effective)
