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
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rig.database import open_store
from rig.errors import RigError
from tests.support.small_sim import as_options

KINDS = {
    "EIO": errno.EIO,
    "ENOSPC": errno.ENOSPC,
    "EROFS": errno.EROFS,
    "EDQUOT": errno.EDQUOT,
    "short write": 0,
}
SWEEP = ("sim", "--at-mm", "420,520,640,800,950,1150", "--samples", "1")
SAME_PX = 0.02
_DONE = re.compile(r"\[(\d+)/\d+\]")
_SOURCE = Path(__file__).with_suffix(".c")


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


@dataclass(frozen=True)
class Ended:
    """What a program left behind."""

    code: int
    err: str


def build(folder: Path) -> Path:
    """Compile the library that lets calls fail.

    Raises:
        FileNotFoundError: there is no C compiler.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise FileNotFoundError("no C compiler (cc, gcc, clang)")
    made = folder / "disk_faults.so"
    command = [compiler, "-O1", "-shared", "-fPIC", "-o", made, _SOURCE, "-ldl"]
    subprocess.run(command, check=True, capture_output=True)
    return made


class Campaign:
    """Sweeps with one library."""

    def __init__(self, library: Path, folder: Path) -> None:
        self._library = library
        self._folder = folder
        store = self._fresh("counted")
        ended = self._rig(store, "sweep", *SWEEP, *as_options(), fault=(0, 0, 0))
        if ended.code not in (0, 3):
            raise RuntimeError(ended.err)
        # Programs that it starts in between, a compiler's for one, tell their own numbers.
        self._calls = max(map(int, (self._folder / "count").read_text().split()))
        self._points = _slopes(store)

    def play(self, seed: int, number: int) -> Round:
        """Take one sweep on a failing disk, and resume it on one that is well."""
        rng = random.Random(f"{seed} {number}")  # noqa: S311
        kind = rng.choice(list(KINDS))
        call, calls = rng.randint(1, self._calls), rng.choice((1, 1, 3, 0))
        store = self._fresh(f"round_{number}")
        ended = self._rig(store, "sweep", *SWEEP, *as_options(), fault=(call, calls, KINDS[kind]))
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
        words = ("--resume",) if before else SWEEP[1:]
        ended = self._rig(store, "sweep", "sim", *words, *as_options())
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
        around = dict(os.environ, RIG_DATABASE=f"sqlite:///{store / 'rig.sqlite'}")
        around.pop("RIG_FRAMES", None)
        if fault is not None:
            call, calls, what = fault
            around |= {
                "LD_PRELOAD": str(self._library),
                "RIG_FAULT_FOLDER": str(store),
                "RIG_FAULT_CALL": str(call),
                "RIG_FAULT_CALLS": str(calls),
                "RIG_FAULT_ERRNO": str(what),
                "RIG_FAULT_COUNT": str(self._folder / "count"),
            }
        command = [sys.executable, "-m", "rig", *words]
        done = subprocess.run(command, env=around, capture_output=True, text=True, timeout=300)  # noqa: PLW1510
        return Ended(done.returncode, done.stderr)


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
    with open_store(f"sqlite:///{store / 'rig.sqlite'}") as opened:
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
    with open_store(f"sqlite:///{store / 'rig.sqlite'}") as opened:
        newest = max(sweep.id for sweep in opened.sweeps())
        return [m.slope_px or 0.0 for m in opened.measurements(newest).values()]


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.disk_faults")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--record", type=Path)
    asked = parser.parse_args(arguments)
    rounds = [_round(line) for line in _lines(asked.record)]
    with tempfile.TemporaryDirectory(prefix="rig-disk-") as folder:
        campaign = Campaign(build(Path(folder)), Path(folder))
        for number in range(len(rounds), asked.count):
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
