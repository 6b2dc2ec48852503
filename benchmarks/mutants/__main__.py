"""Draw faults with a fixed seed, try them, and name the survivors."""

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue

import coverage

from benchmarks.mutants.covering import PACKAGES, Covering
from benchmarks.mutants.equivalent import reason
from benchmarks.mutants.operators import Mutation, mutations
from benchmarks.mutants.recorder import FOLDER, LINES
from benchmarks.mutants.trial import Copy, Outcome, Verdict

TREE = Path(__file__).resolve().parents[2]
RECORD = TREE / "benchmarks" / "out" / "mutants"
OUTCOMES = RECORD / "outcomes.jsonl"


def record(workers: int, *, with_slow: bool) -> None:
    """Run the quick tests once, or all, and note which runs which line."""
    RECORD.mkdir(parents=True, exist_ok=True)
    for file in RECORD.iterdir():
        file.unlink()
    dealt = ("-n", str(workers), "--dist", "loadgroup", "--no-loadscope-reorder")
    chosen = () if with_slow else ("-m", "not slow")
    noted = ("-q", "-p", "benchmarks.mutants.recorder")
    subprocess.run(
        [sys.executable, "-m", "pytest", *noted, *chosen, *dealt],
        cwd=TREE,
        env=os.environ | {FOLDER: str(RECORD), "PYTEST_ADDOPTS": "--hypothesis-profile=ci"},
        check=False,  # tests that fail are left out of the record
    )
    lines = coverage.CoverageData(str(RECORD / LINES))
    for part in sorted(RECORD.glob(f"{LINES}.*")):
        of_worker = coverage.CoverageData(str(part))
        of_worker.read()
        lines.update(of_worker)
    lines.write()


def drawn(count: int, seed: int, within: str) -> list[Mutation]:
    """Return `count` faults of all files whose path begins with `within`."""
    every = [
        mutation
        for folder in PACKAGES.values()
        for path in sorted((TREE / folder).rglob("*.py"))
        if "migrations" not in path.parts
        for mutation in mutations(path.relative_to(TREE).as_posix(), path.read_bytes())
    ]
    chosen = [mutation for mutation in every if mutation.path.startswith(within)]
    return random.Random(seed).sample(chosen, min(count, len(chosen)))  # noqa: S311


def tried(
    faults: list[Mutation], covering: Covering, workers: int, until_s: float = math.inf
) -> Iterator[Outcome]:
    """Try each fault in one of `workers` copies of the tree; yields each as it ends.

    None is begun after `until_s` of the monotonic clock.
    """
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        copies = [Copy(TREE, Path(folder) / str(index)) for index in range(workers)]
        idle: SimpleQueue[Copy] = SimpleQueue()
        for copy in copies:
            copy.require_sound(covering.quickest())
            idle.put(copy)

        def attempt(mutation: Mutation) -> Outcome | None:
            if time.monotonic() > until_s:
                return None
            copy = idle.get()
            try:
                tests = covering.tests(mutation.path, mutation.line)
                return copy.try_fault(mutation, tests, covering.duration_s(tests))
            finally:
                idle.put(copy)

        for attempted in as_completed([pool.submit(attempt, fault) for fault in faults]):
            outcome = attempted.result()
            if outcome is not None:
                yield outcome
        for copy in copies:
            copy.close()


def known() -> dict[str, Verdict]:
    """Return what earlier calls wrote of each fault."""
    if not OUTCOMES.exists():
        return {}
    lines = map(json.loads, OUTCOMES.read_text().splitlines())
    return {line["fault"]: Verdict(line["verdict"]) for line in lines}


def told(faults: list[Mutation], verdicts: dict[str, Verdict]) -> Iterator[str]:
    """Yield the share that was noticed, and what was not."""
    judged = [(fault, verdicts[fault.key]) for fault in faults if fault.key in verdicts]
    survivors = [fault for fault, verdict in judged if verdict is Verdict.SURVIVED]
    counted = len(judged) - sum(reason(fault) is not None for fault in survivors)
    noticed = len(judged) - len(survivors)
    hanging = sum(verdict is Verdict.HANGS for _, verdict in judged)
    yield (
        f"{noticed} of {counted} faults noticed ({100 * noticed / max(counted, 1):.1f} %), "
        f"{hanging} of them by the clock alone; {len(faults) - len(judged)} not yet tried"
    )
    for fault in survivors:
        yield f"- {fault} {reason(fault) or ''}"


def main() -> None:
    """Parse, draw, try, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--within", default="", help="only files whose path begins with this")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin none after these")
    parser.add_argument(
        "--recorded", action="store_true", help="which test runs which line is known"
    )
    parser.add_argument(
        "--resume", action="store_true", help="go on behind the last call, with its record"
    )
    parser.add_argument(
        "--all", action="store_true", help="record the slow tests too (renders with mitsuba)"
    )
    options = parser.parse_args()
    until_s = time.monotonic() + 60 * options.minutes
    if not (options.recorded or options.resume):
        record(options.workers, with_slow=options.all)
    if not options.resume:
        OUTCOMES.unlink(missing_ok=True)
    faults = drawn(options.count, options.seed, options.within)
    verdicts = known()
    waiting = [fault for fault in faults if fault.key not in verdicts]
    with OUTCOMES.open("a") as file:
        for one in tried(waiting, Covering(TREE, RECORD), options.workers, until_s):
            verdicts[one.mutation.key] = one.verdict
            line = {"fault": one.mutation.key, "verdict": one.verdict}
            file.write(json.dumps(line) + "\n")
            file.flush()
            sys.stderr.write(
                f"{one.verdict} {one.took_s:.0f} s, {one.tests} tests: {one.mutation}\n"
            )
    print("\n".join(told(faults, verdicts)))


if __name__ == "__main__":
    main()
