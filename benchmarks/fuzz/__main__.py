"""Valid inputs of every parser, changed at random: what is refused, and what goes wrong.

    python -m benchmarks.fuzz --count 20000 --seed 1 --record fuzz.jsonl
    python -m benchmarks.fuzz --only toml,mcap --count 1000
    python -m benchmarks.fuzz --only cells --first 1234 --count 1 --seed 1

Every input is drawn from parser, seed and number alone. Allowed is to read it, or an error of rig
in one line, within 1 s of processor time and 200 MB. With `--record` a second call goes on where
the first one ended. Exit code 1 where something else came.
"""

import argparse
import json
import multiprocessing
import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.fuzz.sources import SOURCES, Source, fresh
from benchmarks.fuzz.trial import bound_memory, tried

BATCH = 500
PATIENCE_S = 600.0


@dataclass(frozen=True)
class Batch:
    """What some inputs of one parser did."""

    source: str
    seed: int
    first: int
    count: int
    read: int
    refused: int
    slowest_s: float
    broken: tuple[tuple[int, str], ...]
    """Number of the input, and what it did."""


def main(arguments: Sequence[str]) -> int:
    asked = _asked(arguments)
    known = list(_recorded(asked.record))
    names = asked.only.split(",") if asked.only else [source.name for source in SOURCES]
    batches: list[Batch] = []
    until_s = time.monotonic() + 60.0 * asked.minutes
    for source in (source for source in SOURCES if source.name in names):
        count = max(1, round(asked.count * source.share))
        for first in range(asked.first, asked.first + count, BATCH):
            size = min(BATCH, asked.first + count - first)
            place = (source.name, asked.seed, first, size)
            found = next((b for b in known if (b.source, b.seed, b.first, b.count) == place), None)
            if found is None and time.monotonic() > until_s:
                break
            if found is None:
                found = _in_a_process(source, asked.seed, first, size)
                _record(asked.record, found)
            batches.append(found)
            for number, what in found.broken:
                print(f"{source.name} --seed {asked.seed} --first {number}: {what}", flush=True)
        _print(source.name, [batch for batch in batches if batch.source == source.name])
    return 1 if any(batch.broken for batch in batches) else 0


def _asked(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz")
    parser.add_argument("--count", type=int, default=1000, help="inputs of every parser")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--only", default="", help="parsers, with commas between them")
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no batch after these")
    parser.add_argument("--record", type=Path, help="a file with one line of JSON a batch")
    return parser.parse_args(arguments)


def _in_a_process(source: Source, seed: int, first: int, count: int) -> Batch:
    """Read in a process of its own, which may be killed by what it reads."""
    begin = multiprocessing.get_context("fork")
    ours, theirs = begin.Pipe(duplex=False)
    at_work = begin.Value("l", first)
    process = begin.Process(target=_read_all, args=(source, seed, first, count, theirs, at_work))
    process.start()
    theirs.close()
    told = _told(ours)
    if told is None:
        process.kill()
        process.join()
        what = f"the program ended with {process.exitcode} or stood still"
        return Batch(source.name, seed, first, count, 0, 0, 0.0, ((at_work.value, what),))
    process.join()
    return Batch(source.name, seed, first, count, **told)


def _told(answer: Any) -> dict[str, Any] | None:
    """Return what the process says; None where it ends or stands still without a word."""
    if not answer.poll(PATIENCE_S):
        return None
    try:
        return answer.recv()
    except EOFError:
        return None


def _read_all(source: Source, seed: int, first: int, count: int, answer: Any, at_work: Any) -> None:
    # Decoders that speak by themselves would fill the terminal.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    outcomes: Counter[str] = Counter()
    broken: list[tuple[int, str]] = []
    slowest_s = 0.0
    with tempfile.TemporaryDirectory(prefix="rig-fuzz-") as folder:
        draw = source.prepare(fresh(Path(folder) / source.name))
        _try(draw, f"{source.name} {seed} warm")
        bound_memory()
        for number in range(first, first + count):
            at_work.value = number
            trial = _try(draw, f"{source.name} {seed} {number}")
            outcomes[trial.outcome] += 1
            slowest_s = max(slowest_s, trial.cpu_s)
            if trial.is_broken:
                broken.append((number, trial.outcome))
    answer.send(
        {
            "read": outcomes["read"],
            "refused": outcomes["refused"],
            "slowest_s": round(slowest_s, 3),
            "broken": tuple(broken),
        }
    )


def _try(draw: Any, seed: str) -> Any:
    return tried(draw(random.Random(seed)))  # noqa: S311


def _recorded(path: Path | None) -> Iterator[Batch]:
    if path is None or not path.is_file():
        return
    for line in path.read_text().splitlines():
        told = json.loads(line)
        told["broken"] = tuple((number, what) for number, what in told["broken"])
        yield Batch(**told)


def _record(path: Path | None, batch: Batch) -> None:
    if path is not None:
        with path.open("a") as file:
            file.write(json.dumps(asdict(batch)) + "\n")


def _print(name: str, batches: Sequence[Batch]) -> None:
    read, refused = (sum(getattr(b, what) for b in batches) for what in ("read", "refused"))
    slowest_s = max((batch.slowest_s for batch in batches), default=0.0)
    broken = sum(len(batch.broken) for batch in batches)
    print(
        f"{name:9s} {sum(b.count for b in batches):7d} inputs: {read} read, {refused} refused, "
        f"slowest {slowest_s:.2f} s, {broken} broken",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
