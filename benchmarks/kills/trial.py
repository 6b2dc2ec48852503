"""One verb of the campaign: how it begins, what must be left, how it goes on."""

import functools
import shutil
import tempfile
from abc import ABC, abstractmethod
from pathlib import Path

from benchmarks.program import Ended, run_program
from rig.database import Store, open_store
from rig.store.repair import repair
from rig.store.verify import verify
from tests.support.small_sim import SMALL_PAIR, as_options
from tests.support.stores import sqlite_url

OPTIONS = tuple(as_options(SMALL_PAIR))
PLAN = ("--set", "sweep.holdout_every=0", "--set", "sweep.backward_every=0",
        # A resumed sweep grabs more often, and noise is drawn by the number of the grab: its
        # pictures would be others. 1e12 electrons still turn a grey value of x.5 over, 1e30 none.
        "--set", "world.sensor.electrons_per_level=1e30",
        "--set", "world.sensor.read_noise_levels=0")  # fmt: skip
STOPS = ("--at-mm", "400,500,650,900,1200", "--samples", "1")
GOOD = (0, 3)
"""Exit codes of a verb that came to its end."""


def sweep_words(url: str, *more: str) -> list[str]:
    """Return a small sweep, from its beginning unless `more` says otherwise."""
    stops = () if "--resume" in more else STOPS
    return ["sweep", "sim", *more, *OPTIONS, *PLAN, *stops, "--db", url]


@functools.cache
def swept() -> Path:
    """Return a folder with one concluded sweep."""
    folder = Path(tempfile.mkdtemp(prefix="rig-swept-"))
    ended = run_program(sweep_words(sqlite_url(folder)), folder)
    if ended.code not in GOOD:
        raise SystemExit(f"the sweep that all begins with ends with {ended.code}: {ended.err}")
    return folder


def litter_of(store: Store) -> list[str]:
    """Put a store in order, and return what is left that should not be."""
    done = repair(store, verify(store).findings)
    left = [str(finding) for finding in verify(store).findings]
    return [*left, *done.refused]


class Trial(ABC):
    """One verb."""

    verb = ""

    def __init__(self, server: str | None) -> None:
        self.server = server
        self.wanted = ""
        """What an undisturbed run leaves, as text."""

    def url(self, folder: Path) -> str:
        """Return the address of its database."""
        return sqlite_url(folder)

    def prepare(self, folder: Path) -> None:
        """Put what it begins with into an empty folder."""
        shutil.copytree(swept(), folder, dirs_exist_ok=True)

    @abstractmethod
    def words(self, folder: Path) -> list[str]:
        """Return its command line."""

    @abstractmethod
    def result(self, folder: Path) -> object:
        """Return what must be the same after every way to the end."""

    def reference(self, folder: Path) -> None:
        """Keep the result of an undisturbed run."""
        self.wanted = repr(self.result(folder))

    def broken(self, folder: Path, ended: Ended) -> list[str]:
        """Look what was left, go on to the end, and compare."""
        faults = self.lost(folder, ended)
        if ended.code in GOOD:
            again = ended
        else:
            words = self.words_again(folder)
            again = run_program(words, folder)
        if again.code not in GOOD:
            return [*faults, f"it does not go on: {again.code}, {again.err[-400:]!r}"]
        found = repr(self.result(folder))
        if found != self.wanted:
            faults.append(f"another result: {found[:300]}, wanted {self.wanted[:300]}")
        with open_store(self.url(folder)) as store:
            faults += litter_of(store)
        return faults

    def words_again(self, folder: Path) -> list[str]:
        """Return the command that goes on."""
        return self.words(folder)

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """Look for what was acknowledged and is not there."""
        del folder, ended
        return []


def curve_of(url: str, sweep_id: int) -> object:
    """Return the newest curve of a sweep; None where it has none."""
    with open_store(url) as store:
        number = store.newest_curve(sweep_id)
        return None if number is None else store.curve(number).curve
