"""A disk that fails below the file system while a sweep is taken: what is lost, and what is said.

    python -m benchmarks.disk_faults --count 100 --seed 1 --record disk_faults.jsonl

Every round takes a small sweep of the simulated rig with one fault at a random call that writes,
synchronises, opens, renames or makes a folder below the store: input/output error, full disk,
read-only, quota, a short write; once or from there on. Then the disk is well, and the sweep is
resumed. Needs a C compiler and Linux. Every round is drawn from seed and number alone; with
`--record` a second call goes on where the first one ended. Exit code 1 where a promise was broken.
"""

import argparse
import errno
import json
import random
import re
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.failing_disk import arm, begin_with_it
from benchmarks.kills.trial import OPTIONS
from benchmarks.program import Ended, run_program, warm_up
from rig.database import open_store
from rig.errors import RigError
from tests.support.stores import sqlite_url

KINDS = {
    "EIO": errno.EIO,
    "ENOSPC": errno.ENOSPC,
    "EROFS": errno.EROFS,
    "EDQUOT": errno.EDQUOT,
    "short write": 0,
}
SWEEP = ("sim", *OPTIONS, "--at-mm", "420,520,640,800,950,1150", "--samples", "1")
SAME_PX = 0.02
_DONE = re.compile(r"\[(\d+)/\d+\]")


@dataclass(frozen=True)
class Round:
    """One sweep on one failing disk."""

    number: int
    kind: str
    call: int
    calls: int
    """0: from there on."""
    code: int
    said: str
    broken: tuple[str, ...]


class Campaign:
    """Sweeps that begin in one folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        warm_up(["sweep", *SWEEP, "--db", sqlite_url(self._fresh("warmed"))])
        store = self._fresh("counted")
        ended = self._rig(store, "sweep", *SWEEP, fault=(0, 0, 0))
        if ended.code not in (0, 3):
            raise RuntimeError(ended.err)
        self._calls = ended.calls
        self._points = _slopes(store)

    def play(self, seed: int, number: int) -> Round:
        """Take one sweep on a failing disk, and resume it on one that is well."""
        rng = random.Random(f"{seed} {number}")  # noqa: S311
        kind = rng.choice(list(KINDS))
        call, calls = rng.randint(1, self._calls), rng.choice((1, 1, 3, 0))
        store = self._fresh(f"round_{number}")
        ended = self._rig(store, "sweep", *SWEEP, fault=(call, calls, KINDS[kind]))
        broken = list(_wrongly_said(ended))
        before, unread = _stored(store)
        broken += unread
        told = max(map(int, _DONE.findall(ended.err)), default=0)
        if told > len(before):
            broken.append(f"{told} samples told, {len(before)} stored")
        if ended.code not in (0, 3):
            broken += self._resumed(store, before)
        elif not self._is_right(store):
            broken.append("another curve than on a disk that is well")
        shutil.rmtree(store)
        last = ended.err.strip().splitlines()[-1:] or [""]
        return Round(number, kind, call, calls, ended.code, last[0][:300], tuple(broken))

    def _resumed(self, store: Path, before: dict[tuple[int, int], str]) -> list[str]:
        """What is wrong after the disk is well again."""
        words = ("--resume", *OPTIONS) if before else SWEEP[1:]
        ended = self._rig(store, "sweep", "sim", *words)
        if ended.code != 0 and "it is concluded" in ended.err:
            ended = self._rig(store, "fit", "1")  # only its report was lost
        if ended.code not in (0, 3):
            return [f"not resumed: {ended.err[-300:]}"]
        after, unread = _stored(store)
        lost = [key for key, content in before.items() if after.get(key) != content]
        wrong = [] if self._is_right(store) else ["another curve after resuming"]
        return unread + wrong + [f"lost {key}" for key in lost]

    def _is_right(self, store: Path) -> bool:
        """Whether all slopes are those of a disk that is well, but for the noise of pictures."""
        found = _slopes(store)
        return len(found) == len(self._points) and all(
            abs(slope - wanted) < SAME_PX for slope, wanted in zip(found, self._points, strict=True)
        )

    def _fresh(self, name: str) -> Path:
        store = self._folder / name
        shutil.rmtree(store, ignore_errors=True)
        store.mkdir()
        return store

    def _rig(self, store: Path, *words: str, fault: tuple[int, int, int] | None = None) -> Ended:
        call, count, what = fault or (0, 0, 0)
        on = [*words, "--db", sqlite_url(store)]
        return run_program(on, self._folder, first=lambda: arm(store, call, count, what))


def _wrongly_said(ended: Ended) -> Sequence[str]:
    if ended.code not in (0, 1, 3):
        return (f"exit code {ended.code}: {ended.err[-300:]}",)
    if "Traceback" in ended.err:
        return (f"a traceback: {ended.err[-300:]}",)
    errors = [line for line in ended.err.splitlines() if line.startswith("rig: ")]
    if ended.code == 1 and len(errors) != 1:
        return (f"{len(errors)} lines: {errors}",)
    return ()


def _stored(store: Path) -> tuple[dict[tuple[int, int], str], list[str]]:
    """Hashes of all stored samples, and what cannot be read of them."""
    found: dict[tuple[int, int], str] = {}
    unread: list[str] = []
    if not (store / "rig.sqlite").is_file():
        return found, unread
    with open_store(sqlite_url(store)) as opened:
        for sweep in opened.sweeps():
            for sample in opened.samples(sweep.id):
                found[sample.key] = " ".join(frame.sha256 for frame in sample.frames)
                try:
                    opened.load(sample)
                except RigError as error:
                    unread.append(str(error))
    return found, unread


def _slopes(store: Path) -> list[float]:
    """Slopes of the newest sweep, in the order of its plan."""
    with open_store(sqlite_url(store)) as opened:
        newest = max(sweep.id for sweep in opened.sweeps())
        return [m.slope_px or 0.0 for m in opened.measurements(newest).values()]


def main(arguments: Sequence[str]) -> int:
    """Play every round that is not on record yet."""
    begin_with_it("benchmarks.disk_faults", arguments)
    parser = argparse.ArgumentParser(prog="python -m benchmarks.disk_faults")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no round after these")
    parser.add_argument("--record", type=Path, help="file of JSON lines, continued")
    asked = parser.parse_args(arguments)
    rounds = [_round(line) for line in _lines(asked.record)]
    with tempfile.TemporaryDirectory(prefix="rig-disk-") as folder:
        campaign = Campaign(Path(folder))
        until_s = time.monotonic() + 60.0 * asked.minutes
        for number in range(len(rounds), asked.count):
            if time.monotonic() > until_s:
                break
            played = campaign.play(asked.seed, number)
            rounds.append(played)
            if asked.record is not None:
                with asked.record.open("a") as file:
                    file.write(json.dumps(asdict(played)) + "\n")
            for what in played.broken:
                print(f"round {number}, {played.kind} at {played.call}: {what}", flush=True)
    codes = Counter((played.kind, played.code) for played in rounds)
    print(f"{len(rounds)} sweeps, {sum(bool(p.broken) for p in rounds)} broken; by fault and exit")
    print(", ".join(f"{kind} {code}: {count}" for (kind, code), count in sorted(codes.items())))
    return 1 if any(played.broken for played in rounds) else 0


def _round(line: str) -> Round:
    told: dict[str, Any] = json.loads(line)
    told["broken"] = tuple(told["broken"])
    return Round(**told)


def _lines(path: Path | None) -> list[str]:
    return path.read_text().splitlines() if path is not None and path.is_file() else []


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
