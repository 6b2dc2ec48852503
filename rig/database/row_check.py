"""Rows as the file holds them, each looked at by itself: one that is damaged hides no other.

What SQLAlchemy makes of a column ends at the first value that is none. Here values come as the
driver gives them, and each is held to the column that it stands in.
"""

import json
import math
import re
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any, cast, get_args

from sqlalchemy import BigInteger, Boolean, Column, Double, Integer, Table, text
from sqlalchemy.orm import Session

from rig.database.columns import CanonicalJson, UtcTime
from rig.database.convert import below
from rig.database.details import read_details
from rig.database.tables import Row
from rig.errors import RigError
from rig.plan import Direction, Role
from rig.records import DamagedRow, State

RawRow = Mapping[str, object]
_WORDS = {
    ("sweeps", "state"): get_args(State),
    ("stops", "role"): get_args(Role),
    ("stops", "direction"): get_args(Direction),
}
_NO_TEXT = re.compile("[\ud800-\udfff]")
_LONGEST = 60
"""Letters of a value that a message shows."""


def table_of(name: str) -> Table:
    """Return one of the tables."""
    return Row.metadata.tables[name]


def damaged_rows(session: Session) -> Iterator[DamagedRow]:
    """Yield every row that cannot be read, or that refers to one that is not there."""
    keys: dict[tuple[str, tuple[str, ...]], set[tuple[object, ...]]] = {}
    for table in Row.metadata.sorted_tables:
        wanted = _references(table)
        for row in raw_rows(session, table):
            found = problem(table, row) or _lost(table, row, keys, wanted)
            if found:
                yield DamagedRow(table.name, key_of(table, row), found)
            for name, columns in _referred(table):
                keys.setdefault((name, columns), set()).add(tuple(row.get(c) for c in columns))


def raw_rows(session: Session, table: Table) -> Iterator[RawRow]:
    """Yield the rows of a table as the driver gives them, in the order of their keys."""
    order = ", ".join(column.name for column in table.primary_key.columns)
    with _undecoded(session):
        found = session.execute(text(f"SELECT * FROM {table.name} ORDER BY {order}"))  # noqa: S608
        yield from cast("Iterator[RawRow]", found.mappings())


def problem(table: Table, row: RawRow) -> str:
    """Say what is wrong with the values of a row; empty where nothing is."""
    for cell in _cells(table):
        found = _cell_problem(cell, row.get(cell.name))
        if found:
            return f"{cell.name}: {found}"
    return ""


def key_of(table: Table, row: RawRow) -> str:
    """Return the key of a row, as messages name it."""
    return " ".join(_shown(row.get(column.name)) for column in table.primary_key.columns)


@dataclass(frozen=True, slots=True)
class _Cell:
    """What may stand in one column."""

    name: str
    may_be_empty: bool
    is_good: Callable[[object], bool]
    wanted: str
    words: tuple[str, ...]
    is_folder: bool
    is_details: bool


@cache
def _cells(table: Table) -> tuple[_Cell, ...]:
    return tuple(
        _Cell(
            column.name,
            bool(column.nullable),
            *_wanted(column),
            words=_WORDS.get((table.name, column.name), ()),
            is_folder=column.name == "folder",
            is_details=(table.name, column.name) == ("measurements", "details"),
        )
        for column in table.columns
    )


def _cell_problem(cell: _Cell, value: object) -> str:
    if value is None:
        return "" if cell.may_be_empty else "nothing is there"
    if isinstance(value, str) and _NO_TEXT.search(value):
        return f"{_shown(value)} is no text"
    if not cell.is_good(value):
        return f"{_shown(value)}, wanted is {cell.wanted}"
    if cell.words and value not in cell.words:
        return f"{_shown(value)}, wanted is one of {', '.join(cell.words)}"
    try:
        if cell.is_folder:
            below(Path(), cast("str", value))
        if cell.is_details:
            read_details(json.loads(cast("str", value)))
    except RigError as error:
        return error.found
    return ""


def _wanted(column: Column[Any]) -> tuple[Callable[[object], bool], str]:
    match column.type:
        case CanonicalJson():
            return _is_object, "a JSON object"
        case UtcTime():
            return _is_time, "a time with its zone"
        case Boolean():
            return (lambda value: value in (0, 1)), "true or false"
        case Integer() | BigInteger():
            return (lambda value: type(value) is int), "a whole number"
        case Double():
            return _is_number, "a finite number"
        case _:
            return (lambda value: isinstance(value, str)), "a text"


def _is_object(value: object) -> bool:
    if not isinstance(value, str):
        return False
    try:
        return isinstance(json.loads(value), dict)
    except (ValueError, RecursionError):
        return False


def _is_time(value: object) -> bool:
    if not isinstance(value, str):
        return False
    try:
        return datetime.fromisoformat(value).tzinfo is not None
    except ValueError:
        return False


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


_Reference = tuple[tuple[str, ...], str, tuple[str, ...]]


def _references(table: Table) -> list[_Reference]:
    return [
        (
            tuple(constraint.column_keys),
            constraint.referred_table.name,
            tuple(element.column.name for element in constraint.elements),
        )
        for constraint in table.foreign_key_constraints
    ]


def _referred(table: Table) -> Iterator[tuple[str, tuple[str, ...]]]:
    for other in Row.metadata.sorted_tables:
        for _, name, columns in _references(other):
            if name == table.name:
                yield name, columns


def _lost(
    table: Table,
    row: RawRow,
    keys: Mapping[tuple[str, tuple[str, ...]], set[tuple[object, ...]]],
    references: Sequence[_Reference],
) -> str:
    for own, name, columns in references:
        value = tuple(row.get(column) for column in own)
        if None not in value and value not in keys.get((name, columns), set()):
            numbers = " ".join(_shown(part) for part in value)
            return f"refers to {name} {numbers}, where nothing is"
    return ""


@contextmanager
def _undecoded(session: Session) -> Generator[None]:
    """Let SQLite hand over texts that are none: one of them must not end the table."""
    connection: Any = session.connection().connection.driver_connection
    if session.get_bind().dialect.name != "sqlite":
        yield
        return
    before = connection.text_factory
    connection.text_factory = lambda content: content.decode(errors="surrogateescape")
    try:
        yield
    finally:
        with suppress(AttributeError):
            connection.text_factory = before


def _shown(value: object) -> str:
    shown = ascii(value) if isinstance(value, str) and not value.isprintable() else str(value)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST - 3]}..."
