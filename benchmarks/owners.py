"""Two to eight programs at one sweep, one album or one folder, some killed: what is left.

    python -m benchmarks.owners --count 200 --seed 1 --record owners.jsonl
    python -m benchmarks.owners --database postgresql+psycopg://user@host/rig --count 50

Every round is drawn from seed and number alone. With `--record` a second call goes on where the
first one ended. Exit code 1 where a promise was broken.
"""

import argparse
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rig.calibrate.album import Album
from rig.calibrate.pictures import Picture
from rig.database import Store, open_store
from rig.errors import OwnedError, StoreError
from rig.folder_lock import FolderLock
from rig.profile.load import load_profile
from tests.support.multiviews import noisy_multiview, same_multiview
from tests.support.stores import STOPS, new_sweep, sqlite_url

KINDS = ("sweep", "album", "folder")
SAMPLES = 3
"""Per stop."""
PICTURES = 6
LINES = 40
DEATH = 0.06
"""Chance to be killed at each step of an owner."""
SHOT = 0.25
"""Chance to be killed from outside."""
LATEST_S = 0.15
"""Longest wait before the next one is shot at."""
PATIENCE_S = 120.0
Say = Callable[[str], None]


@dataclass(frozen=True)
class Round:
    """One crowd at one thing."""

    number: int
    kind: str
    programs: int
    killed: int
    refused: int
    owners: int
    broken: tuple[str, ...]


class Thing:
    """What only one program may work on, and how far it is."""

    def __init__(self, kind: str, url: str, folder: Path) -> None:
        self.kind, self.url, self.folder = kind, url, folder
        self.sweep_id = 0
        with open_store(url) as store:
            if kind == "sweep":
                self.sweep_id = new_sweep(store, samples_per_stop=SAMPLES)
                self.folder = store.sweep(self.sweep_id).folder
            elif kind == "album":
                self.folder = Album.new(store.frames, load_profile("sim")).folder

    def work(self, say: Say) -> bool:
        """Do what is left as its owner; True once nothing is."""
        with open_store(self.url) as store:
            match self.kind:
                case "sweep":
                    return self._sweep(store, say)
                case "album":
                    return self._album(store, say)
                case _:
                    return self._fill(say)

    def _sweep(self, store: Store, say: Say) -> bool:
        if store.sweep(self.sweep_id).state == "concluded":
            return True
        with store.owned_sweep(self.sweep_id, "asked to work"):
            say("begin")
            if store.sweep(self.sweep_id).state != "concluded":
                store.reopen_sweep(self.sweep_id)
                there = {sample.key for sample in store.samples(self.sweep_id)}
                for stop in STOPS:
                    for number in range(SAMPLES):
                        if (stop.index, number) not in there:
                            self._sample(store, stop.index, number)
                            say(f"did {stop.index} {number}")
                store.save_curve(self.sweep_id, curve={}, holdout={}, versions={})
            say("end")
        return True

    def _sample(self, store: Store, stop: int, number: int) -> None:
        store.add_sample(
            self.sweep_id,
            stop=stop,
            number=number,
            reached_mm=1.0,
            multiview=noisy_multiview(SAMPLES * stop + number, size_px=(16, 12)),
        )

    def _album(self, store: Store, say: Say) -> bool:
        album = Album.unfinished(store.frames, load_profile("sim"))
        with store.owned(album.lease, album.folder, "asked to work"):
            say("begin")
            there = sum(1 for _ in album.pictures())
            for number in range(there, PICTURES):
                album.keep(Picture(number, noisy_multiview(number, size_px=(16, 12))))
                say(f"did {number}")
            say("end")
        return True

    def _fill(self, say: Say) -> bool:
        with FolderLock(self.folder):
            say("begin")
            file = self.folder / "lines"
            there = file.read_text().count("\n") if file.exists() else 0
            with file.open("a") as lines:
                for number in range(there, LINES):
                    lines.write(f"{number}\n")
                    lines.flush()
                    say(f"did {number}")
            say("end")
        return True

    def broken(self, done: Sequence[str]) -> list[str]:
        """Compare what is there with what was acknowledged and planned."""
        try:
            FolderLock(self.folder).release()  # a killed owner leaves a file that holds nothing
        except OwnedError:
            return ["a lock was left behind"]
        with open_store(self.url) as store:
            if store.owners():
                return ["a lease was left behind"]
            match self.kind:
                case "sweep":
                    return self._broken_sweep(store, done)
                case "album":
                    pictures = Album(self.folder, store.modes).pictures()
                    there = [str(picture.number) for picture in pictures]
                    planned = [str(number) for number in range(PICTURES)]
                case _:
                    there = (self.folder / "lines").read_text().split()
                    planned = [str(number) for number in range(LINES)]
        return [] if there == planned else [f"{there} is there, {planned} was planned"]

    def _broken_sweep(self, store: Store, done: Sequence[str]) -> list[str]:
        samples = store.samples(self.sweep_id)
        keys = [" ".join(map(str, sample.key)) for sample in samples]
        row = next(row for row in store.sweeps() if row.id == self.sweep_id)
        curves = _curves(store, self.sweep_id)
        faults = [f"{key} was acknowledged and is lost" for key in set(done) - set(keys)]
        if len(keys) != SAMPLES * len(STOPS):
            faults.append(f"{len(keys)} samples of {SAMPLES * len(STOPS)}")
        if row.state != "concluded" or curves != 1:
            faults.append(f"state {row.state} with {curves} curves")
        for sample in samples:
            seed = SAMPLES * sample.stop.index + sample.number
            if not same_multiview(store.load(sample), noisy_multiview(seed, size_px=(16, 12))):
                faults.append(f"sample {sample.key} holds other pictures")
        if list(self.folder.glob("stop_*/.sample_*.tmp")):
            faults.append("half-written frames were left behind")
        return faults


def _curves(store: Store, sweep_id: int) -> int:
    """Count the curves of a sweep; their numbers run through all sweeps."""
    count, number = 0, 1
    while True:
        try:
            count += store.curve(number).sweep_id == sweep_id
        except StoreError:
            return count
        number += 1


def play(number: int, seed: int, url: str | None) -> Round:
    """Let a crowd loose on one thing, and look what is left."""
    draw = random.Random(f"{seed} {number}")  # noqa: S311  (nobody guesses)
    kind = KINDS[number % len(KINDS)]
    programs = draw.randint(2, 8)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["RIG_FRAMES"] = str(folder / "frames")
        thing = Thing(kind, url or sqlite_url(folder), folder)
        journal = folder / "journal"
        seeds = [draw.random() for _ in range(programs)]
        children = [_start(thing, journal, one) for one in seeds]
        for pid in children:  # at any moment, beside those that fall at a step of their own
            time.sleep(draw.random() * LATEST_S)
            if draw.random() < SHOT:
                os.kill(pid, signal.SIGKILL)
        killed = {pid for pid in children if os.WIFSIGNALED(os.waitpid(pid, 0)[1])}
        last = _start(thing, journal, None)  # whatever happened, the next one brings it to its end
        code = os.waitpid(last, 0)[1]
        lines = [line.split(" ", 2) for line in journal.read_text().splitlines()]
        broken = [] if code == 0 else [f"the last one could not go on: {code}"]
        broken += _overlaps(lines, killed)
        broken += thing.broken([words[2] for words in lines if words[1] == "did"])
        counts = Counter(words[1] for words in lines)
    return Round(
        number, kind, programs, len(killed), counts["refused"], counts["begin"], tuple(broken)
    )


def _start(thing: Thing, journal: Path, seed: float | None) -> int:
    """Fork one program; returns its number."""
    pid = os.fork()
    if pid:
        return pid
    code = 1
    try:
        code = _program(thing, journal, seed)
    except BaseException as error:  # whatever it is, the parent is told
        sys.stderr.write(f"{type(error).__name__}: {error}\n")
    finally:
        os._exit(code)


def _program(thing: Thing, journal: Path, seed: float | None) -> int:
    draw = random.Random(seed)  # noqa: S311  (nobody guesses)
    out = os.open(journal, os.O_WRONLY | os.O_APPEND | os.O_CREAT)

    def say(text: str) -> None:
        os.write(out, f"{os.getpid()} {text}\n".encode())
        if seed is not None and text != "refused" and draw.random() < DEATH:
            os.kill(os.getpid(), signal.SIGKILL)

    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        try:
            if thing.work(say):
                return 0
        except OwnedError:
            say("refused")
        time.sleep(draw.random() * 0.02)
    return 2


def _overlaps(lines: Sequence[Sequence[str]], killed: set[int]) -> list[str]:
    """Find two that worked at the same time; who was killed says no end."""
    owner: int | None = None
    faults: list[str] = []
    for pid_text, what, *_ in lines:
        pid = int(pid_text)
        if what == "begin":
            if owner is not None and owner not in killed:
                faults.append(f"{pid} began while {owner} was at work")
            owner = pid
        elif what in ("did", "end") and owner != pid:
            faults.append(f"{pid} worked while {owner} was the owner")
        if what == "end":
            owner = None
    return faults


def main() -> int:
    """Play every round that is not on record yet."""
    parser = argparse.ArgumentParser(description="Several programs at one thing.")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--database", help="a server; default: a SQLite file per round")
    parser.add_argument("--record", type=Path, help="file of JSON lines, continued")
    options = parser.parse_args()
    rounds: list[Round] = []
    if options.record is not None and options.record.exists():
        for line in options.record.read_text().splitlines():
            kept = json.loads(line)
            if kept.pop("seed") == options.seed:
                rounds.append(Round(broken=tuple(kept.pop("broken")), **kept))
    for number in range(len(rounds), options.count):
        rounds.append(play(number, options.seed, options.database))
        if options.record is not None:
            with options.record.open("a") as file:
                file.write(json.dumps({"seed": options.seed, **asdict(rounds[-1])}) + "\n")
    broken = [fault for one in rounds for fault in one.broken]
    totals = {
        name: sum(getattr(one, name) for one in rounds)
        for name in ("programs", "killed", "refused", "owners")
    }
    told = ", ".join(f"{count} {name}" for name, count in totals.items())
    print(f"seed {options.seed}: {len(rounds)} rounds, {told}, {len(broken)} broken promises")
    for fault in broken:
        print(fault)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
