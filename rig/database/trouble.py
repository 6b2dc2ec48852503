"""What goes wrong with databases, each in one line with a way out."""

import re
import sqlite3
from collections.abc import Generator
from contextlib import contextmanager

from sqlalchemy.exc import DBAPIError, SQLAlchemyError, StatementError

from rig.database.postgresql import BY_STATE, GONE
from rig.disk import FULL, READ_ONLY, disk_explained
from rig.errors import StoreError
from rig.secrets import without_secrets

# Beginnings of SQLite's result codes (https://sqlite.org/rescode.html).
_OF_SQLITE = {
    "SQLITE_FULL": FULL,
    "SQLITE_READONLY": READ_ONLY,
    "SQLITE_CANTOPEN": (
        "it cannot be opened",
        "check that its directory exists and may be written",
    ),
    "SQLITE_BUSY": ("another program holds it locked", "let that one finish and try again"),
    "SQLITE_LOCKED": ("another program holds it locked", "let that one finish and try again"),
    "SQLITE_NOTADB": ("the file is no SQLite database", "choose another with --db"),
    "SQLITE_CORRUPT": (
        "the file is damaged",
        "bring back a copy, or rescue it with sqlite3 .recover",
    ),
    "SQLITE_IOERR": ("reading or writing failed", "look whether the disk is full, gone or failing"),
}

_REFUSED = re.compile(r"FATAL:\s+(.*)")
_DAMAGED = _OF_SQLITE["SQLITE_CORRUPT"]


@contextmanager
def explained(doing: str, place: object) -> Generator[None]:
    """Turn errors of system and database into one `StoreError`.

    Args:
        doing: what was asked, to follow "cannot".
        place: file, folder or database, shown as it is: without a password.

    Raises:
        StoreError: instead of `OSError` and everything that SQLAlchemy raises.
    """
    try:
        with disk_explained(doing, place):
            yield
    except (SQLAlchemyError, sqlite3.Error) as error:
        found, advice = _found_by_database(error)
        raise StoreError(f"{place}: cannot {doing}: {found}", advice=advice) from error
    except UnicodeDecodeError as error:  # a text of the file, or what SQLite says of one
        found, advice = _DAMAGED
        raise StoreError(f"{place}: cannot {doing}: {found}", advice=advice) from error
    except UnicodeEncodeError as error:
        raise StoreError(
            f"{place}: cannot {doing}: a text holds what is no character",
            advice="write names and notes in UTF-8",
        ) from error


def _found_by_database(error: SQLAlchemyError | sqlite3.Error) -> tuple[str, str]:
    """Return what the database found, and what to do."""
    cause = error.orig if isinstance(error, StatementError) else error
    if isinstance(cause, sqlite3.Error):
        # Errors of the module itself, not of the library below it, carry no name.
        name = getattr(cause, "sqlite_errorname", "")
        for beginning, found in _OF_SQLITE.items():
            if name.startswith(beginning):
                return found
    if (state := str(getattr(cause, "sqlstate", None))) in BY_STATE:
        return BY_STATE[state]
    text = without_secrets(str(cause))
    refused = _REFUSED.search(text)  # it was reached
    if isinstance(error, DBAPIError) and not refused:
        is_of_server = type(cause).__module__.startswith("psycopg")
        if error.connection_invalidated or (is_of_server and "connection" in text):
            return GONE
    if refused is not None:
        return f"the server answers: {refused[1]}", "check address, user and database of --db"
    first_line = text.partition("\n")[0]
    return f"the database answers: {first_line}", "check it, or choose another with --db"
