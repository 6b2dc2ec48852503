"""All rows of one database into another one, of the same kind or of another."""

import hashlib
import json
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, Table, func, insert, select, text

from rig.database.location import Location
from rig.database.schema import open_engine, writing
from rig.database.tables import LeaseRow, Row
from rig.errors import StoreError

_AT_ONCE = 500
TABLES = tuple(
    table for table in Row.metadata.sorted_tables if table.name != LeaseRow.__tablename__
)
"""All that is kept, those first that others refer to. Who works on what stays where it is."""


def is_empty(connection: Connection) -> bool:
    """Tell whether no table holds a row."""
    return not any(_count(connection, table) for table in TABLES)


def copied_rows(source: Connection, file: Path) -> None:
    """Write all rows into a new SQLite file.

    Raises:
        StoreError: a row came back otherwise than it was.
    """
    engine: Engine = open_engine(Location(URL.create("sqlite", database=str(file)), file.parent))
    try:
        with writing(engine).begin() as target:
            copy_rows(source, target, str(file))
    finally:
        engine.dispose()


def copy_rows(source: Connection, target: Connection, name: str) -> dict[str, int]:
    """Copy all rows within two transactions, and compare what came back.

    Args:
        source: read from.
        target: empty.
        name: of the target, for messages.

    Returns:
        How many rows each table has.

    Raises:
        StoreError: the target is not empty, or a row came back otherwise than it was.
    """
    if not is_empty(target):
        found = ", ".join(f"{_count(target, table)} {table.name}" for table in TABLES)
        raise StoreError(
            f"{name}: asked to copy into an empty database, found {found}",
            advice="name one that is not there yet",
        )
    for table in TABLES:
        for rows in _in_parts(source, table):
            target.execute(insert(table), rows)
        _count_on(target, table)
    counts: dict[str, int] = {}
    for table in TABLES:
        there, here = _digest(source, table), _digest(target, table)
        if there != here:
            raise StoreError(
                f"{name}: the rows of {table.name} came back otherwise than they were "
                f"({there[0]} there, {here[0]} here)",
                advice="nothing was changed; report it with the versions of both databases",
            )
        counts[table.name] = here[0]
    return counts


def _in_parts(source: Connection, table: Table) -> Iterator[list[dict[str, Any]]]:
    ordered = select(table).order_by(*table.primary_key.columns)
    found = source.execute(ordered.execution_options(yield_per=_AT_ONCE))
    for part in found.mappings().partitions():
        yield [dict(row) for row in part]


def _count(connection: Connection, table: Table) -> int:
    return connection.execute(select(func.count()).select_from(table)).scalar_one()


def _count_on(target: Connection, table: Table) -> None:
    """Let a server count on from the last number; SQLite does so by itself."""
    if target.dialect.name != "postgresql" or "id" not in table.columns:
        return
    target.execute(
        text(
            f"SELECT setval(pg_get_serial_sequence('{table.name}', 'id'), max(id)) "  # noqa: S608
            f"FROM {table.name} HAVING max(id) IS NOT NULL"
        )
    )


def _digest(connection: Connection, table: Table) -> tuple[int, str]:
    digest, count = hashlib.sha256(), 0
    for rows in _in_parts(connection, table):
        count += len(rows)
        for row in rows:
            digest.update(json.dumps(row, sort_keys=True, default=_as_text).encode())
    return count, digest.hexdigest()


def _as_text(value: object) -> str:
    if isinstance(value, datetime):
        return value.isoformat()
    raise TypeError(type(value).__name__)
