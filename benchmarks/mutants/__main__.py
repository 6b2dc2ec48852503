"""Draw faults with a fixed seed, try them, and name the survivors."""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

import coverage

from benchmarks.mutants.covering import PACKAGES, Covering
from benchmarks.mutants.equivalent import reason
from benchmarks.mutants.operators import Mutation, mutations
from benchmarks.mutants.recorder import FOLDER, LINES
from benchmarks.mutants.trial import Copy, Outcome

TREE = Path(__file__).resolve().parents[2]
RECORD = TREE / "benchmarks" / "out" / "mutants"


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


def tried(faults: list[Mutation], covering: Covering, workers: int) -> list[Outcome]:
    """Try each fault in one of `workers` copies of the tree; says each outcome on stderr."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        copies = [Copy(TREE, Path(folder) / str(index)) for index in range(workers)]
        idle: SimpleQueue[Copy] = SimpleQueue()
        for copy in copies:
            copy.require_sound(covering.quickest())
            idle.put(copy)

        def attempt(mutation: Mutation) -> Outcome:
            copy = idle.get()
            try:
                tests = covering.tests(mutation.path, mutation.line)
                outcome = copy.try_fault(mutation, tests, covering.duration_s(tests))
            finally:
                idle.put(copy)
            verdict = "killed" if outcome.is_killed else "SURVIVED"
            sys.stderr.write(
                f"{verdict} {outcome.took_s:.0f} s, {outcome.tests} tests: {mutation}\n"
            )
            return outcome

        outcomes = list(pool.map(attempt, faults))
        for copy in copies:
            copy.close()
        return outcomes


def main() -> None:
    """Parse, draw, try, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--within", default="", help="only files whose path begins with this")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--recorded", action="store_true", help="which test runs which line is known"
    )
    parser.add_argument(
        "--all", action="store_true", help="record the slow tests too (renders with mitsuba)"
    )
    options = parser.parse_args()
    if not options.recorded:
        record(options.workers, with_slow=options.all)
    faults = drawn(options.count, options.seed, options.within)
    outcomes = tried(faults, Covering(TREE, RECORD), options.workers)
    survivors = [outcome for outcome in outcomes if not outcome.is_killed]
    equal = [one for one in survivors if reason(one.mutation) is not None]
    counted = len(outcomes) - len(equal)
    killed = len(outcomes) - len(survivors)
    print(f"{killed} of {counted} faults noticed ({100 * killed / max(counted, 1):.1f} %)")
    for outcome in survivors:
        print(f"- {outcome.mutation} [{outcome.tests} tests] {reason(outcome.mutation) or ''}")
    (RECORD / "outcomes.json").write_text(
        json.dumps([{"fault": str(one.mutation), "killed": one.is_killed} for one in outcomes])
    )


if __name__ == "__main__":
    main()
