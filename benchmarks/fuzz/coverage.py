"""How much of each parser the changed inputs reach: branches, in the functions that reading enters.

    python -m benchmarks.fuzz.coverage --count 500 --seed 1

Files that read also write; a function that no input enters is left out of the share and named with
`--all`, so that a writer can be told from a part of a parser that is never reached.
"""

import argparse
import json
import random
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from coverage import Coverage

from benchmarks.fuzz.sources import SOURCES, Source, fresh
from benchmarks.fuzz.trial import tried

ROOT = Path(__file__).parents[2]
GEOMETRY = ("rig/export/geometry_import.py", "rig/bounded_text.py")
FILES: Mapping[str, tuple[str, ...]] = {
    "toml": ("rig/profile/load.py", "rig/bounded_text.py"),
    "pfm": ("rig/depth/pfm.py",),
    "pictures": ("rig/pictures/*.py",),
    "mcap": ("rig/recording/*read*.py", "rig/recording/mcap_*.py"),
    "stage": (
        *("drivers/rig_drivers/grbl/dialect.py", "drivers/rig_drivers/marlin/dialect.py"),
        *("drivers/rig_drivers/marlin/settings.py", "drivers/rig_drivers/zaber/message.py"),
        "drivers/rig_drivers/command/answer.py",
    ),
    "cells": ("rig/database/cells.py", "rig/database/convert.py", "rig/database/row_check.py"),
}
"""Where the parsers are; of an import its own file, and what all imports share."""


def reached(source: Source, seed: int, count: int) -> dict[str, dict[str, Any]]:
    """Read so many inputs; returns functions of the parser's files, as coverage tells them."""
    patterns = FILES.get(source.name, (f"rig/export/{source.name}*.py", *GEOMETRY))
    files = [str(file) for pattern in patterns for file in ROOT.glob(pattern)]
    watched = Coverage(branch=True, data_file=None, include=files, config_file=False)
    with tempfile.TemporaryDirectory(prefix="rig-fuzz-") as name:
        folder = Path(name)
        draw = source.prepare(fresh(folder / source.name))
        for number in range(count):
            read = draw(random.Random(f"{source.name} {seed} {number}"))  # noqa: S311
            watched.start()
            try:
                tried(read)
            finally:
                watched.stop()
        report = folder / "report.json"
        watched.json_report(outfile=str(report))
        told: dict[str, Any] = json.loads(report.read_text())["files"]
    return {f"{file} {name}": one for file, found in told.items()
            for name, one in found["functions"].items() if name}  # fmt: skip


def share(functions: Iterable[Mapping[str, Any]]) -> tuple[int, int]:
    """Return how many branches of functions that were entered were taken, and how many they have.

    A function without a branch is one that was taken.
    """
    taken = total = 0
    for one in functions:
        if one["executed_lines"]:
            taken += one["summary"]["covered_branches"]
            total += one["summary"]["num_branches"]
    return taken, total


def main() -> int:
    """Print a line for each parser."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz.coverage")
    parser.add_argument("--count", type=int, default=500, help="inputs of every parser")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="parsers, with commas between them")
    parser.add_argument("--all", action="store_true", help="also name what was not reached")
    asked = parser.parse_args()
    for source in SOURCES:
        if asked.only and source.name not in asked.only.split(","):
            continue
        functions = reached(source, asked.seed, max(1, round(asked.count * source.share)))
        taken, total = share(functions.values())
        never = [name for name, one in functions.items() if not one["executed_lines"]]
        entered = len(functions) - len(never)
        pct = 100.0 * taken / total if total else 100.0
        told = f"{taken:4d} of {total:4d} branches ({pct:.0f} %) in {entered} functions"
        print(f"{source.name:9s} {told}, {len(never)} not entered", flush=True)
        if asked.all:
            for name, one in functions.items():
                if one["executed_lines"] and one["missing_branches"]:
                    print(f"  {name}: {one['missing_branches']}")
            print("".join(f"  not entered: {name}\n" for name in never), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
