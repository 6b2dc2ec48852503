"""Verbs that copy a store: backup, migrate."""

import functools
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

from benchmarks.kills.trial import Trial, curve_of, swept
from benchmarks.program import run_program
from rig.database import open_store
from rig.database.location import Location, locate
from rig.database.store import open_at
from rig.store.verify import verify
from tests.support.stores import sqlite_url


class BackupTrial(Trial):
    """`rig store backup`, into a folder with an older one."""

    verb = "backup"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        super().prepare(folder)
        backup = backed_up()
        shutil.copytree(backup, folder / "b")
        file = folder / "b" / "backup.json"
        file.write_text(file.read_text().replace(str(swept()), str(folder)))
        shutil.rmtree(next((folder / "b" / "frames" / "sim").glob("1_*/stop_003*")))  # still to do

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["store", "backup", str(folder / "b"), "--db", sqlite_url(folder)]

    def result(self, folder: Path) -> object:
        """All that the backup holds, brought back."""
        target = folder / "c"
        words = ["store", "restore", str(folder / "b"), "--db", sqlite_url(target)]
        code = run_program(words, folder).code
        with open_store(sqlite_url(target)) as store:
            found = [str(finding) for finding in verify(store).findings]
            return code, found, len(store.samples(1)), curve_of(sqlite_url(target), 1)


@functools.cache
def backed_up() -> Path:
    """Return a folder with a backup of `swept`."""
    folder = Path(tempfile.mkdtemp(prefix="rig-backup-")) / "b"
    words = ["store", "backup", str(folder), "--db", sqlite_url(swept())]
    if run_program(words, folder.parent).code != 0:
        raise SystemExit("the backup that all begins with failed")
    return folder


class MigrateTrial(Trial):
    """`rig store migrate`, again."""

    verb = "migrate"

    def _target(self, folder: Path) -> str:
        return self.server or f"sqlite:///{folder / 'new.sqlite'}"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`; a server is emptied."""
        super().prepare(folder)
        if self.server is not None:
            _empty(self.server)

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        more = ("--copy-frames",) if self.server is not None else ()
        return ["store", "migrate", self._target(folder), *more, "--db", sqlite_url(folder)]

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; where all rows arrived there is nothing to do."""
        with open_at(self._location(folder)) as store:
            is_done = not store.is_empty()
        return ["history", "--db", sqlite_url(folder)] if is_done else self.words(folder)

    def result(self, folder: Path) -> object:
        """Every number of the new database."""
        with open_at(self._location(folder)) as store:
            counts = len(store.samples(1)), len(store.measurements(1)), len(store.owners())
            return counts, store.curve(1).curve, store.sweep(1).state

    def _location(self, folder: Path) -> Location:
        location = locate(self._target(folder), {})
        return replace(location, frames=folder / "frames")


def _empty(server: str) -> None:
    from sqlalchemy import create_engine, text  # noqa: PLC0415

    engine = create_engine(server)
    with engine.begin() as connection:
        connection.execute(text("DROP SCHEMA public CASCADE"))
        connection.execute(text("CREATE SCHEMA public"))
    engine.dispose()
