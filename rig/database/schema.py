"""From a location to an engine whose tables are those of this program."""

import os
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, inspect, text
from sqlalchemy.exc import NoSuchModuleError
from sqlalchemy.pool import StaticPool

from rig.database.location import Location
from rig.database.postgresql import open_server, take_turns
from rig.database.tables import Row
from rig.database.trouble import explained
from rig.errors import StoreError
from rig.files import make_folder, sync_folder

REVISIONS = (
    *("rig_0001", "rig_0002", "rig_0003", "rig_0004", "rig_0005", "rig_0006"),
    "rig_0007",
)
"""Every schema this program knows, oldest first; a test holds them to `migrations/versions`."""

MIGRATIONS = Path(__file__).parent / "migrations"


def empty_engine() -> Engine:
    """Return an engine for a database that is not there: it reads as empty, and leaves no file."""
    engine = create_engine(
        "sqlite://", poolclass=StaticPool, connect_args={"check_same_thread": False}
    )
    Row.metadata.create_all(engine)
    return engine


def open_engine(location: Location) -> Engine:
    """Open a database; make or upgrade its tables where they are missing or old.

    A database of a newer schema, or of another program, is not touched.

    Raises:
        StoreError: it cannot be opened, is not ours, or is newer than this program.
    """
    with explained("open the database", location):
        if location.file is not None:
            make_folder(location.file.parent, location.modes.folder)
            _make_private(location.file, location.modes.file)
        engine = _create(location)
        try:
            with engine.connect() as connection:
                found = revision(connection, location)
            if location.file is not None:
                _keep_a_write_ahead_log(engine)
            if found != REVISIONS[-1]:
                upgrade(location)
        except BaseException:
            engine.dispose()
            raise
    return engine


def writing(engine: Engine) -> Engine:
    """Return the engine for transactions that write: SQLite then takes its lock at the start.

    A transaction that reads first and writes later would fail at once, without waiting, when
    another program wrote in between (SQLITE_BUSY_SNAPSHOT).
    """
    return engine.execution_options(writes=True)


def _make_private(file: Path, mode: int) -> None:
    """Make an empty file where there is none; SQLite gives its mode to the files beside it."""
    try:
        handle = os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode)
    except FileExistsError:
        return
    os.close(handle)
    file.chmod(mode)
    sync_folder(file.parent)


def _create(location: Location, *, prepared: bool = True) -> Engine:
    try:
        if location.is_server:
            return open_server(location.url)
        engine = create_engine(location.url)
    except NoSuchModuleError as error:
        kind = location.url.drivername
        raise StoreError(
            f"{location}: no such kind of database: {kind}", advice="try sqlite:///"
        ) from error
    except ModuleNotFoundError as error:
        raise StoreError(
            f"{location}: the Python driver {error.name} is not installed",
            advice="pip install 'epirig[postgres]'" if location.is_server else "pip install it",
        ) from error
    if location.file is not None:
        event.listen(engine, "connect", _prepare_sqlite if prepared else _prepare_to_rewrite)
        event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: Any, _: object) -> None:
    # The module's own idea of transactions leaves out changes of tables; ours begin by hand.
    connection.isolation_level = None
    connection.execute("PRAGMA foreign_keys = ON")
    # A sample reported as stored survives a power cut, at a few ms per sample.
    connection.execute("PRAGMA synchronous = FULL")


def _prepare_to_rewrite(connection: Any, made: object) -> None:
    _prepare_sqlite(connection, made)
    # A table that others refer to is written anew under the same name; `upgrade` looks afterwards.
    connection.execute("PRAGMA foreign_keys = OFF")


def _begin_sqlite(connection: Connection) -> None:
    writes = connection.get_execution_options().get("writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _keep_a_write_ahead_log(engine: Engine) -> None:
    """Readers and the writer then never wait for each other; the file remembers it."""
    connection = engine.raw_connection()
    try:
        connection.cursor().execute("PRAGMA journal_mode = WAL")
    finally:
        connection.close()


def revision(connection: Connection, location: Location) -> str | None:
    """Return the schema found, None in an empty database."""
    tables = inspect(connection).get_table_names()
    if not tables:
        return None
    found: list[str] = []
    if "alembic_version" in tables:
        found = list(connection.scalars(text("SELECT version_num FROM alembic_version")))
    if not any(revision.startswith("rig_") for revision in found):
        raise StoreError(
            f"{location}: asked for a database of rig, found one with the tables "
            f"{', '.join(tables[:5])} of another program",
            advice="choose another with --db",
        )
    if len(found) > 1 or found[0] not in REVISIONS:
        raise StoreError(
            f"{location}: the database has schema {', '.join(found)}, this rig knows up to "
            f"{REVISIONS[-1]}",
            advice="upgrade rig (the database was not touched)",
        )
    return found[0]


def upgrade(location: Location) -> None:
    """Bring the tables of a database to those of this program.

    One transaction: all or nothing. A second program waits and then finds the work done.
    """
    engine = _create(location, prepared=False)
    try:
        with writing(engine).begin() as connection:
            if location.is_server:
                take_turns(connection)
            migrate(connection)
    finally:
        engine.dispose()


def migrate(connection: Connection) -> None:
    """Bring the tables of one connection to those of this program, within its transaction.

    Raises:
        StoreError: rows would refer to others that are not there; nothing was changed.
    """
    # Slow to import, and needed once in the life of a database.
    from alembic import command  # noqa: PLC0415
    from alembic.config import Config  # noqa: PLC0415

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    command.upgrade(config, "head")
    if connection.dialect.name != "sqlite":
        return
    lost = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchone()
    if lost is not None:
        raise StoreError(
            f"the database cannot be upgraded: a row of {lost[0]} refers to {lost[2]}, where "
            "nothing is",
            advice="bring back a copy, or report it (the database was not touched)",
        )
