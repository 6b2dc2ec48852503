"""Words that a shell can complete: names of profiles, numbers of what is in the database.

A key of a keyboard waits for the answer: nothing heavy is imported, the database is only read, and
whatever goes wrong is no word.
"""

import os
import sqlite3
from contextlib import closing
from pathlib import Path

import typer

from rig.places import default_database, profile_files

_SQLITE = "sqlite:///"


def profile_names(incomplete: str) -> list[str]:
    """Return the names of profiles that begin with this."""
    return [path.stem for path in profile_files() if path.stem.startswith(incomplete)]


def sweep_numbers(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the numbers of sweeps that begin with this, newest first."""
    return _numbers(ctx, "sweeps", incomplete)


def calibration_numbers(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the numbers of calibrations that begin with this, newest first."""
    return _numbers(ctx, "calibrations", incomplete)


def calibration_choices(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return what `--calibration` takes: a number, or none."""
    return [
        *calibration_numbers(ctx, incomplete),
        *(word for word in ("none",) if word.startswith(incomplete)),
    ]


def curve_numbers(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the numbers of curves that begin with this, newest first."""
    return _numbers(ctx, "curves", incomplete)


def exportable_numbers(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the numbers of calibrations and sweeps that begin with this."""
    both = [*calibration_numbers(ctx, incomplete), *sweep_numbers(ctx, incomplete)]
    return list(dict.fromkeys(both))


def _numbers(ctx: typer.Context, table: str, incomplete: str) -> list[str]:
    path = _database(ctx.params.get("database"))
    if path is None:
        return []
    try:
        with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection:
            rows = connection.execute(f"SELECT id FROM {table} ORDER BY id DESC")  # noqa: S608
            return [str(number) for (number,) in rows if str(number).startswith(incomplete)]
    except sqlite3.Error:
        return []


def _database(given: object) -> Path | None:
    """Return the SQLite file; other databases are not asked."""
    url = given if isinstance(given, str) else os.environ.get("RIG_DATABASE", "")
    if not url:
        return default_database(os.environ)
    return Path(url.removeprefix(_SQLITE)).absolute() if url.startswith(_SQLITE) else None
