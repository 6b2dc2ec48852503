"""A PostgreSQL server that is slow, silent, or starts again: waited for, but not for ever."""

import time
from collections.abc import Mapping
from typing import Any, Final

from sqlalchemy import URL, Connection, Engine, create_engine, event

CONNECT_S: Final = 10
"""Longest wait for a server to take a connection; `connect_timeout` in the URL says otherwise."""
STATEMENT_S: Final = 20
"""Longest time that the server may work on one statement, or wait for another program's lock;
`options=-c statement_timeout=...` in the URL says otherwise."""
SILENCE_S: Final = 30
"""Longest wait for an answer. The server cannot end a statement itself when it is stopped or its
network is lost."""
RETURN_S: Final = 30
"""A server that was there before may take so long to start again."""
_PAUSE_S: Final = 0.2
_OPENING: Final = 7_041_776
"""Number of the lock under which tables are made; other programs of this server know nothing of
it, and two of rig that open a new database together take turns."""

BY_STATE: Final[Mapping[str, tuple[str, str]]] = {
    "53100": ("the disk of the server is full", "free space there, then try again"),
    "53300": ("the server has no place for one more program", "end another, or raise its limit"),
    "25006": ("it may only be read", "choose another with --db"),
    "57014": (
        f"the server did not end a statement in time (usually {STATEMENT_S} s)",
        "look what else it is doing, then try again",
    ),
    "57P01": ("the server ended the connection", "try again when it is back"),
    "57P03": ("the server is starting or stopping", "try again when it is back"),
    "28P01": ("the server refuses the password", "check user and password of --db"),
    "28000": ("the server refuses the user", "check user and address of --db"),
    "3D000": ("the server has no such database", "make it with createdb, or check --db"),
    "42501": ("the user may not do that", "grant it, or choose another user in --db"),
    "55P03": ("another program holds it locked", "let that one finish and try again"),
    "40P01": ("two programs waited for each other", "try again"),
}
"""What the server's codes mean (https://www.postgresql.org/docs/current/errcodes-appendix.html)."""
GONE: Final = (
    "the server does not answer (stopped, starting again, or its network is lost)",
    "what was stored is safe; try again when it is back, a sweep goes on with --resume",
)


def open_server(url: URL) -> Engine:
    """Return an engine whose every wait has an end.

    A connection is tried before it is used, and made anew where the server started again in
    between.

    Raises:
        ModuleNotFoundError: psycopg is not installed.
    """
    engine = create_engine(url, pool_pre_ping=True)
    event.listen(engine, "do_connect", _Connecting())
    if "options" not in url.query:
        event.listen(engine, "connect", _bound)
    return engine


def take_turns(connection: Connection) -> None:
    """Wait for other programs that make or upgrade the tables; until the transaction ends."""
    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_OPENING})")


class _Connecting:
    """Connects; waits for a server that was there before."""

    def __init__(self) -> None:
        self._was_there = False

    def __call__(self, _: object, __: object, arguments: list[Any], named: dict[str, Any]) -> Any:
        import psycopg  # noqa: PLC0415  (an extra)

        until_s = time.monotonic() + (RETURN_S if self._was_there else 0.0)
        patient = {"connect_timeout": CONNECT_S, **named}
        while True:
            try:
                connection = _impatient(psycopg).connect(*arguments, **patient)
            except psycopg.OperationalError:
                if time.monotonic() >= until_s:
                    raise
                time.sleep(_PAUSE_S)
            else:
                self._was_there = True
                return connection


def _bound(connection: Any, _: object) -> None:
    with connection.cursor() as cursor:
        cursor.execute(f"SET statement_timeout = {1000 * STATEMENT_S}")
    connection.commit()


def _impatient(psycopg: Any) -> Any:
    class Impatient(psycopg.Connection):  # type: ignore[misc]
        """Gives up when nothing comes for too long, which the library never does by itself."""

        def wait(self, gen: Any, *arguments: Any, **named: Any) -> Any:
            until_s = time.monotonic() + SILENCE_S
            try:
                return super().wait(gen, *arguments, **{"timeout": SILENCE_S, **named})
            except psycopg.OperationalError as error:
                if time.monotonic() < until_s:
                    raise
                self.pgconn.finish()  # whatever comes later belongs to nobody
                raise psycopg.OperationalError(f"no answer for {SILENCE_S} s") from error

    return Impatient
