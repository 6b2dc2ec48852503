"""One open database and its two kinds of transaction."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Engine, event
from sqlalchemy.orm import Session

from rig.database.cells import require_sound
from rig.database.location import Location
from rig.database.schema import writing
from rig.database.tables import Row
from rig.database.trouble import explained
from rig.errors import StoreError

for _moment in ("load", "refresh"):
    event.listen(Row, _moment, lambda row, *_: require_sound(row), propagate=True)


class Transactions:
    """Where every part of the store reads and writes; trouble comes out as `StoreError`."""

    def __init__(self, location: Location, engine: Engine) -> None:
        self._engine = engine
        self.modes = location.modes
        """Permission bits of files and folders."""
        self._file = location.file
        self._is = _identity(self._file)
        self.database = str(location)
        """Address of the database, as it may be shown: without a password."""

    @contextmanager
    def _reading(self, doing: str) -> Generator[Session]:
        with explained(doing, self.database), Session(self._engine) as session:
            self._require_in_place()
            yield session

    @contextmanager
    def _writing(self, doing: str) -> Generator[Session]:
        with (
            explained(doing, self.database),
            Session(writing(self._engine)) as session,
            session.begin(),
        ):
            self._require_in_place()
            session.connection()  # SQLite waits here for others; one may have moved the file
            self._require_in_place()
            yield session

    def _require_in_place(self) -> None:
        """Notice a file that was removed: SQLite would go on writing into nowhere.

        Raises:
            StoreError: the file is gone, or another one is at its place.
        """
        if self._is is not None and _identity(self._file) != self._is:
            raise StoreError(
                f"{self.database}: the database is gone, or another one is at its place "
                "(unmounted, deleted, network share lost)",
                advice="bring it back and go on; what was stored is in it",
            )


def _identity(file: Path | None) -> tuple[int, int] | None:
    """Return what tells a file from another one of its name; None where there is none."""
    if file is None:
        return None
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
