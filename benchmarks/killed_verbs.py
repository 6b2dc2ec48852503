"""Verbs of the campaign `benchmarks.kills`: how each begins, what must be left, how it goes on."""

import functools
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from benchmarks import killed_scan
from benchmarks.program import Ended, run_program
from rig.database import Store, open_store
from rig.database.location import Location, locate
from rig.database.store import open_at
from rig.errors import RigError
from rig.live.captured import read_capture
from rig.store.repair import repair
from rig.store.verify import verify
from tests.support.small_sim import as_options
from tests.support.stores import sqlite_url

PLAN = ("--set", "sweep.holdout_every=0", "--set", "sweep.backward_every=0",
        # A resumed sweep grabs more often: with noise its pictures would be others.
        "--set", "world.sensor.electrons_per_level=1e12",
        "--set", "world.sensor.read_noise_levels=0")  # fmt: skip
STOPS = ("--at-mm", "400,500,650,900,1200", "--samples", "1")
FRAMES = 4
PICTURES = 6
HAND = ("--set", "world.renderer=analytic", "--set", "world.hand.hold_s=0.7",
        "--set", "world.hand.move_s=0.05")  # fmt: skip
_EMPTY = "holds no whole multi-view"
GOOD = (0, 3)
"""Exit codes of a verb that came to its end."""


def sweep_words(folder: Path, *more: str) -> list[str]:
    """Return a small sweep, from its beginning unless `more` says otherwise."""
    stops = () if "--resume" in more else STOPS
    return ["sweep", "sim", *more, *as_options(), *PLAN, *stops, "--db", sqlite_url(folder)]


@functools.cache
def swept() -> Path:
    """Return a folder with one concluded sweep."""
    folder = Path(tempfile.mkdtemp(prefix="rig-swept-"))
    ended = run_program(sweep_words(folder), folder)
    if ended.code not in GOOD:
        raise SystemExit(f"the sweep that all begins with ends with {ended.code}: {ended.err}")
    return folder


def litter_of(store: Store) -> list[str]:
    """Put a store in order, and return what is left that should not be."""
    done = repair(store, verify(store).findings)
    left = [str(finding) for finding in verify(store).findings]
    return [*left, *done.refused]


class Trial:
    """One verb."""

    verb = ""

    def __init__(self, server: str | None) -> None:
        self.server = server
        self.wanted = ""
        """What an undisturbed run leaves, as text."""

    def prepare(self, folder: Path) -> None:
        """Put what it begins with into an empty folder."""
        shutil.copytree(swept(), folder, dirs_exist_ok=True)

    def words(self, folder: Path) -> list[str]:
        """Return its command line."""
        raise NotImplementedError

    def result(self, folder: Path) -> object:
        """Return what must be the same after every way to the end."""
        raise NotImplementedError

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
        with open_store(sqlite_url(folder)) as store:
            faults += litter_of(store)
        return faults

    def words_again(self, folder: Path) -> list[str]:
        """Return the command that goes on."""
        return self.words(folder)

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """Look for what was acknowledged and is not there."""
        del folder, ended
        return []


def _curve_of(folder: Path, sweep_id: int) -> object:
    with open_store(sqlite_url(folder)) as store:
        number = store.newest_curve(sweep_id)
        return None if number is None else store.curve(number).curve


class SweepTrial(Trial):
    """`rig sweep`, gone on with by `--resume`."""

    verb = "sweep"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        del folder
        swept()

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return sweep_words(folder)

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; a sweep that has no row yet begins anew."""
        with open_store(sqlite_url(folder)) as store:
            rows = store.sweeps()
        if not rows:
            return sweep_words(folder)
        if rows[-1].state == "concluded":
            return ["report", str(rows[-1].id), "--db", sqlite_url(folder)]
        return sweep_words(folder, "--resume")

    def result(self, folder: Path) -> object:
        """Curve, samples and state; a second curve is one too many."""
        with open_store(sqlite_url(folder)) as store:
            rows = store.sweeps()
            curves = [row.curve_id for row in rows]
            return ([row.state for row in rows], [row.samples for row in rows], curves,
                    _curve_of(folder, 1))  # fmt: skip

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """See `Trial.lost`."""
        with open_store(sqlite_url(folder)) as store:
            there = {
                f"{row.id} {sample.stop.index} {sample.number}"
                for row in store.sweeps()
                for sample in store.samples(row.id)
            }
            damage = [str(finding) for finding in verify(store).damage]
        return [
            *(f"{key} was acknowledged and is lost" for key in set(ended.stored) - there),
            *damage,
        ]


class FitTrial(Trial):
    """`rig fit`, again."""

    verb = "fit"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return ["fit", "1", "--db", sqlite_url(folder)]

    def result(self, folder: Path) -> object:
        """The newest curve, which is that of the sweep itself."""
        with open_store(sqlite_url(folder)) as store:
            return store.sweep(1).state, len(store.measurements(1)), _curve_of(folder, 1)


class CalibrateTrial(Trial):
    """`rig calibrate`, gone on with by `--resume`."""

    verb = "calibrate"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`."""
        del folder

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        pictures = ("--pictures", str(PICTURES), "--lens", "none", "--db", sqlite_url(folder))
        return ["calibrate", "sim", *as_options(), *HAND, *pictures]

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; where no picture was kept it begins anew."""
        albums = [p for p in (folder / "frames" / "sim").glob("calibration_*") if p.is_dir()]
        if any((album / "calibration.json").exists() for album in albums):
            return ["history", "--db", sqlite_url(folder)]
        return [*self.words(folder), *(["--resume"] if albums else [])]

    def result(self, folder: Path) -> object:
        """How many calibrations there are, of how many pictures."""
        with open_store(sqlite_url(folder)) as store:
            return [row.rig for row in store.calibrations()]

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """See `Trial.lost`."""
        there: set[str] = set()
        for album in (folder / "frames" / "sim").glob("calibration_*"):
            file = album / "pictures.jsonl"
            lines = file.read_text().splitlines() if file.exists() else []
            there |= {f"{album.name} {json.loads(line)['number']}" for line in lines}
        return [f"{key} was acknowledged and is lost" for key in set(ended.stored) - there]


class CaptureTrial(Trial):
    """`rig capture` with a recording; another one into a new folder."""

    verb = "capture"

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return self._into(folder, "one")

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`."""
        return self._into(folder, "two")

    def _into(self, folder: Path, name: str) -> list[str]:
        out = ("--out", str(folder / name), "--record", str(folder / f"{name}.mcap"))
        count = ("--frames", str(FRAMES), "--curve", "1", "--db", sqlite_url(folder))
        board = ("--set", "world.capture_scene=board")
        return ["capture", "sim", *as_options(), *board, *count, *out]

    def result(self, folder: Path) -> object:
        """How many frames the capture that came to its end has, by both of its outputs."""
        name = "two" if (folder / "two").exists() else "one"
        sources = (folder / name, folder / f"{name}.mcap")
        return [sum(1 for _ in read_capture(source)) for source in sources]

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """What was written can be read: every whole frame in the folder, and the recording."""
        del ended
        faults: list[str] = []
        for source in (folder / "one", folder / "one.mcap"):
            if not source.exists() or (source.is_dir() and not (source / "frames.jsonl").exists()):
                continue
            try:
                for frame in read_capture(source):
                    _ = frame.slope_px if source.is_dir() else frame.views
            except RigError as error:
                if _EMPTY not in error.found:  # killed before a frame was whole
                    faults.append(f"{source.name} cannot be read: {error}")
        return faults


class ScanTrial(Trial):
    """`rig capture` with a camera on a slider, gone on with by `--resume`."""

    verb = "scan"

    def prepare(self, folder: Path) -> None:
        """See `Trial.prepare`: it begins with nothing."""

    def words(self, folder: Path) -> list[str]:
        """See `Trial.words`."""
        return killed_scan.scan_words(folder)

    def words_again(self, folder: Path) -> list[str]:
        """See `Trial.words_again`; `lost` has gone on already, a complete scan is given again."""
        return killed_scan.scan_words(folder, "--resume")

    def result(self, folder: Path) -> object:
        """The views that were taken, and the slopes of the light field."""
        (frame,) = read_capture(folder / "maps")
        return killed_scan.views_of(folder), bool((frame.label > 0).any())

    def lost(self, folder: Path, ended: Ended) -> list[str]:
        """See `Trial.lost`."""
        return killed_scan.lost_in(folder, ended)


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
            return code, found, len(store.samples(1)), _curve_of(target, 1)


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


VERBS: dict[str, Callable[[str | None], Trial]] = {
    trial.verb: trial
    for trial in (
        SweepTrial,
        FitTrial,
        CalibrateTrial,
        CaptureTrial,
        ScanTrial,
        BackupTrial,
        MigrateTrial,
    )
}
