"""Verbs that look, thin out or bring back: check, history, report, verify, prune, restore."""

import shutil
from pathlib import Path

from benchmarks.kills.copying import backed_up
from benchmarks.kills.trial import OPTIONS, Trial, curve_of
from rig.database import open_store
from rig.store.verify import verify
from tests.support.stores import sqlite_url


class CheckTrial(Trial):
    """`rig check`, which moves the stage and stores nothing."""

    verb = "check"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["check", "sim", *OPTIONS, "--db", sqlite_url(folder)]

    def result(self, folder: Path) -> object:
        """What was there before."""
        with open_store(sqlite_url(folder)) as store:
            return len(store.samples(1)), store.sweep(1).state, curve_of(sqlite_url(folder), 1)


class HistoryTrial(CheckTrial):
    """`rig history`."""

    verb = "history"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["history", "--db", sqlite_url(folder)]


class VerifyTrial(CheckTrial):
    """`rig store verify --repair` of a store with half a sample in it."""

    verb = "verify"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        super().prepare(folder)
        with open_store(sqlite_url(folder)) as store:
            (store.samples(1)[0].folder.parent / ".sample_09.0.tmp").mkdir()
            (store.samples(1)[0].folder.parent / "sample_08").mkdir()

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["store", "verify", "--repair", "--db", sqlite_url(folder)]


class ReportTrial(Trial):
    """`rig report`, over an older one."""

    verb = "report"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["report", "1", "--db", sqlite_url(folder)]

    def result(self, folder: Path) -> object:
        """The page is whole."""
        with open_store(sqlite_url(folder)) as store:
            page = (store.sweep(1).folder / "report.html").read_text()
        return page.startswith("<!doctype html>"), page.rstrip().endswith("</html>")


class PruneTrial(Trial):
    """`rig store prune`; what was cut short is put in order by `verify --repair`."""

    verb = "prune"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["store", "prune", "--rig", "sim", "--yes", "--db", sqlite_url(folder)]

    def result(self, folder: Path) -> object:
        """The numbers stay, and nothing is damaged."""
        with open_store(sqlite_url(folder)) as store:
            found = verify(store)
            return (
                found.damage,
                found.pruned,
                len(store.measurements(1)),
                curve_of(sqlite_url(folder), 1),
            )


class RestoreTrial(Trial):
    """`rig store restore` into a place where nothing is."""

    verb = "restore"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        shutil.copytree(backed_up(), folder / "b")

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["store", "restore", str(folder / "b"), "--db", sqlite_url(folder)]

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; where the database is, nothing is left to do."""
        if (folder / "rig.sqlite").exists():
            return ["store", "verify", "--repair", "--db", sqlite_url(folder)]
        return self.words(folder)

    def result(self, folder: Path) -> object:
        """All that the backup holds."""
        with open_store(sqlite_url(folder)) as store:
            return verify(store).damage, len(store.samples(1)), curve_of(sqlite_url(folder), 1)
