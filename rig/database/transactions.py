"""One open database and its two kinds of transaction."""

from collections.abc import Generator
from contextlib import contextmanager

from sqlalchemy import Engine
from sqlalchemy.orm import Session

from rig.database.location import Location
from rig.database.schema import writing
from rig.database.trouble import explained


class Transactions:
    """Where every part of the store reads and writes; trouble comes out as `StoreError`."""

    def __init__(self, location: Location, engine: Engine) -> None:
        self._engine = engine
        self.database = str(location)
        """Address of the database, as it may be shown: without a password."""

    @contextmanager
    def _reading(self, doing: str) -> Generator[Session]:
        with explained(doing, self.database), Session(self._engine) as session:
            yield session

    @contextmanager
    def _writing(self, doing: str) -> Generator[Session]:
        with (
            explained(doing, self.database),
            Session(writing(self._engine)) as session,
            session.begin(),
        ):
            yield session
