"""How often the verdict of a calibration blames faultless pictures, and how often it sees a fault.

Rigs and faults are those of `benchmarks.verdict_faults`. What was judged is kept in a file, a line
each, and a run that was stopped goes on where it was.

Run: python -m benchmarks.verdict [--rigs 200] [--first 0] [--jobs 2] [--record verdict.jsonl]
"""

import argparse
import json
import multiprocessing
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.verdict_faults import CASES, TRUE_SQUARE_MM, Rig, draw, staged
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import HEIGHT, WIDTH, flat_board_mm

NAMES = ("centre", "right", "low")
STEPS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
CODES = (
    "repeated", "swapped", "turned", "bumped", "unsynchronised", "moved", "blurred",
    "square-size", "outliers", "model",
)  # fmt: skip
"""Of data that are wrong. The others tell what the pictures did not show, which is no alarm: of a
dozen pictures at random they are often true."""

Judged = dict[str, list[str]]
"""Codes that were told, by case."""


def solve(rig: Rig, sightings: list[Sighting]) -> Calibration:
    """Calibrate as `rig calibrate` does, the lens given."""
    return solve_rig(
        sightings, flat_board_mm(), [(WIDTH, HEIGHT)] * 3, NAMES, 0,
        lens="brown5", steps=STEPS, stage_mm=rig.stage_mm,
    )  # fmt: skip


def judge(cases: Sequence[str], seed: int) -> tuple[int, Judged]:
    """Tell what is said of one rig."""
    rig = draw(seed)
    told: Judged = {}
    for name in cases:
        case = CASES[name]
        own = staged(rig, TRUE_SQUARE_MM.get(name)) if case.staged else rig
        told[name] = [reason.code for reason in solve(own, case.make(own)).verdict.reasons]
    return seed, told


def kept(record: Path) -> dict[int, Judged]:
    """What an earlier run has judged, by rig."""
    told: dict[int, Judged] = {}
    for line in record.read_text().splitlines() if record.exists() else ():
        one = json.loads(line)
        told.setdefault(one["rig"], {}).update(one["told"])
    return told


def run(cases: Sequence[str], seeds: Iterable[int], jobs: int, record: Path) -> None:
    """Judge what is not in the record yet."""
    known = kept(record)
    left = [seed for seed in seeds if not set(cases) <= set(known.get(seed, ()))]
    with multiprocessing.get_context("spawn").Pool(jobs) as pool, record.open("a") as lines:
        for seed, told in pool.imap(partial(judge, cases), left):
            lines.write(json.dumps({"rig": seed, "told": told}) + "\n")
            lines.flush()


def report(cases: Sequence[str], told: dict[int, Judged]) -> None:
    """Print how many rigs are told what."""
    print(f"number of {len(told)} rigs that are told so")
    print(f"{'':32s}" + "".join(f"{code:>15s}" for code in ("right", *CODES)))
    for name in cases:
        by_rig = {seed: set(judged[name]) & set(CODES) for seed, judged in told.items()}
        wanted = set(CASES[name].wanted)
        wrong = [
            seed for seed, codes in by_rig.items() if not (codes & wanted if wanted else not codes)
        ]
        counts = Counter(code for codes in by_rig.values() for code in codes)
        numbers = (len(told) - len(wrong), *(counts[code] for code in CODES))
        print(f"{name:32s}" + "".join(f"{number:15d}" for number in numbers))
        if wrong:
            print(f"{'':4s}not right: rigs {', '.join(map(str, sorted(wrong)))}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--record", type=Path, default=Path("verdict.jsonl"))
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.rigs)
    run(asked.cases, seeds, asked.jobs, asked.record)
    told = kept(asked.record)
    report(asked.cases, {seed: told[seed] for seed in seeds})


if __name__ == "__main__":
    main()
