"""`rig` killed, or told to end, at random moments: what is left, and whether it goes on.

    python -m benchmarks.kills --count 100 --seed 1 --record kills.jsonl
    python -m benchmarks.kills --verb sweep --signals --count 100
    python -m benchmarks.kills --verb migrate --database postgresql+psycopg://user@host/rig

Every round is drawn from seed, verb and number alone. Half of the moments are a share of the time
that the verb took undisturbed, so they depend on the speed of the machine; the other half are one
of its calls that write, synchronise, open, rename or make a folder. With `--record` a second call
goes on where the first one ended. Exit code 1 where a promise was broken. Needs Linux and a C
compiler.
"""

import argparse
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.failing_disk import arm, begin_with_it
from benchmarks.kills.trial import Trial
from benchmarks.kills.verbs import VERBS
from benchmarks.program import Ended, run_program, warm_up

QUIET = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
INTERRUPTED = 130
EARLIEST_S = 0.1
"""Before this the program may not have taken over its signals yet, and it is Python that ends."""
_NOT_BEGUN = "Traceback of the program: KeyboardInterrupt"
BY_CALL = 0.5
"""Share of the rounds that end at a call."""
LATEST = 1.05
"""Of the time of an undisturbed run; later ones have ended by themselves."""


@dataclass(frozen=True)
class Round:
    """One verb that was disturbed once."""

    verb: str
    number: int
    signal: int
    after_s: float
    call: int
    """Of those that the disk sees, instead of a time; 0 for none."""
    code: int
    """How it ended: negative for the signal."""
    broken: tuple[str, ...]


@dataclass(frozen=True)
class Whole:
    """One verb undisturbed."""

    took_s: float
    calls: int
    wanted: str


def play(trial: Trial, number: int, seed: int, whole: Whole, *, is_told: bool) -> Round:
    """Begin a verb, disturb it, look what is left, and let it go on."""
    draw = random.Random(f"{seed} {trial.verb} {number}")  # noqa: S311  (nobody guesses)
    kind = draw.choice(QUIET) if is_told else signal.SIGKILL
    after_s = draw.random() * LATEST * whole.took_s
    call = draw.randint(1, whole.calls) if whole.calls and draw.random() < BY_CALL else 0
    with workplace() as folder:
        trial.prepare(folder)
        words = trial.words(folder)
        if call:
            ended = run_program(words, folder, first=lambda: arm(folder, call, 1, -kind))
        else:
            ended = run_program(words, folder, kill_after_s=after_s, number=kind)
        broken = _way_out(ended, kind, after_s) if is_told else []
        broken += trial.broken(folder, ended)
    return Round(trial.verb, number, kind, after_s, call, ended.code, tuple(broken))


def _way_out(ended: Ended, number: int, after_s: float) -> list[str]:
    """Look how a verb ended that was told to."""
    faults: list[str] = []
    is_python = ended.code == -number or _NOT_BEGUN in ended.err
    if after_s < EARLIEST_S and is_python:
        return []
    said = [line for line in ended.err.splitlines() if line.startswith("rig: interrupted; ")]
    if ended.code == INTERRUPTED:
        if len(said) != 1:
            faults.append(f"{len(said)} lines say that it was interrupted: {ended.err[-300:]!r}")
    elif ended.code not in (0, 3):
        faults.append(f"exit code {ended.code}: {ended.err[-300:]!r}")
    if "Traceback" in ended.err:
        faults.append(f"a traceback: {ended.err[-500:]!r}")
    if "moves" in ended.stage:
        faults.append("the stage was left moving")
    return faults


@contextmanager
def workplace() -> Generator[Path]:
    """Give a folder of its own, and the environment that goes with it."""
    folder = Path(tempfile.mkdtemp(prefix="rig-kill-"))
    os.environ.pop("RIG_FRAMES", None)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def undisturbed(trial: Trial) -> Whole:
    """Run a verb as it is, and keep how long it takes and what it leaves."""
    with workplace() as folder:
        trial.prepare(folder)
        begun_s = time.monotonic()
        ended = run_program(trial.words(folder), folder, first=lambda: arm(folder, 0, 0, 0))
        took_s = time.monotonic() - begun_s
        if ended.code not in (0, 3):
            raise SystemExit(f"rig {trial.verb} ends with {ended.code}: {ended.err}")
        trial.reference(folder)
    return Whole(took_s, ended.calls, trial.wanted)


def warm(trial: Trial) -> None:
    """Let a verb run here once, so that every round is quick."""
    with workplace() as folder:
        trial.prepare(folder)
        warm_up(trial.words(folder))


class Campaign:
    """The rounds of some verbs, those on record and those to come."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._trials = [VERBS[verb](options.database) for verb in options.verb or sorted(VERBS)]
        self._whole: dict[str, Whole] = {}
        self.rounds = _recorded(options.record, options.seed)
        self._until_s = time.monotonic() + 60.0 * options.minutes

    def play(self) -> None:
        """Play what is not on record yet, the verbs in turn, until the time is over."""
        for number in range(self._options.count):
            for trial in self._trials:
                if number >= self._done(trial.verb) and time.monotonic() < self._until_s:
                    self._play(trial, number)

    def _undisturbed(self, trial: Trial) -> Whole:
        """Return how long a verb takes; what it leaves is known to the trial from then on."""
        record = self._options.record
        file = None if record is None else record.with_suffix(f".{trial.verb}.json")
        warm(trial)
        if file is not None and file.exists():
            whole = Whole(**json.loads(file.read_text()))
            trial.wanted = whole.wanted
            return whole
        whole = undisturbed(trial)
        if file is not None:
            file.write_text(json.dumps(asdict(whole)))
        return whole

    def _done(self, verb: str) -> int:
        is_told = self._options.signals
        return sum(o.verb == verb and (o.signal != signal.SIGKILL) == is_told for o in self.rounds)

    def _play(self, trial: Trial, number: int) -> None:
        if trial.verb not in self._whole:
            self._whole[trial.verb] = self._undisturbed(trial)
        seed, whole = self._options.seed, self._whole[trial.verb]
        self.rounds.append(play(trial, number, seed, whole, is_told=self._options.signals))
        if self._options.record is not None:
            with self._options.record.open("a") as file:
                file.write(json.dumps({"seed": seed, **asdict(self.rounds[-1])}) + "\n")


def main() -> int:
    """Play every round that is not on record yet, and say what came of them."""
    begin_with_it("benchmarks.kills", sys.argv[1:])
    parser = argparse.ArgumentParser(description="Verbs that are ended at any moment.")
    parser.add_argument("--count", type=int, default=100, help="rounds of every verb")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verb", action="append", choices=sorted(VERBS), help="only these")
    parser.add_argument("--signals", action="store_true", help="tell it to end, do not kill it")
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no round after these")
    parser.add_argument("--database", help="migrate: a server; default: another SQLite file")
    parser.add_argument("--record", type=Path, help="file of JSON lines, continued")
    options = parser.parse_args()
    campaign = Campaign(options)
    campaign.play()
    return _told(campaign.rounds, options.seed)


def _recorded(record: Path | None, seed: int) -> list[Round]:
    rounds: list[Round] = []
    if record is not None and record.exists():
        for line in record.read_text().splitlines():
            kept = json.loads(line)
            if kept.pop("seed") == seed:
                rounds.append(Round(broken=tuple(kept.pop("broken")), **kept))
    return rounds


def _told(rounds: Sequence[Round], seed: int) -> int:
    broken = [(one, fault) for one in rounds for fault in one.broken]
    for verb in sorted({one.verb for one in rounds}):
        mine = [one for one in rounds if one.verb == verb]
        ends = Counter(one.code for one in mine)
        told = ", ".join(f"{count} x {code}" for code, count in sorted(ends.items()))
        faults = sum(len(one.broken) for one in mine)
        print(f"seed {seed}: {verb}: {len(mine)} rounds, ended {told}; {faults} broken promises")
    for one, fault in broken:
        when = f"at call {one.call}" if one.call else f"after {one.after_s:.3f} s"
        print(f"{one.verb} {one.number}, signal {one.signal} {when}: {fault}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
