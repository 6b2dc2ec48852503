"""False positives on pictures without a board, boards through wide lenses, reasons of refusal.

Resumable: what was judged stands in a file, one line a picture; the table is of all that is there.

Run: python -m benchmarks.boards [--seed 1] [--empty 2000] [--wide 1000] [--faulty 1000]
     [--out build/boards.jsonl] [--seconds 240]
"""

import argparse
import json
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from benchmarks.boards.faults import faulty_board
from benchmarks.boards.trials import CHARUCOS, CHECKERS, Trial, wide_board, without_board
from rig.errors import TargetError
from rig.targets import CharucoBoard, find_target

MOST_ERROR_PX, MOST_SIGMAS = 1.0, 6.0
"""A corner farther from its true place, in px and in its own sigmas, has a wrong number."""
Row = dict[str, Any]


def judged(trial: Trial) -> Row:
    """What the finder answers, beside the truth."""
    row: Row = {
        "target": "charuco" if isinstance(trial.target, CharucoBoard) else "checkerboard",
        "board": str(trial.target),
        "kind": trial.kind,
    }
    begun = time.process_time()
    try:
        found = find_target(trial.image, trial.target)
    except TargetError as error:
        took_s = time.process_time() - begun
        right = error.reason in trial.reasons
        return row | {"reason": error.reason, "right": right, "ms": round(took_s * 1e3, 1)}
    took_s = time.process_time() - begun
    row |= {"corners": len(found), "ms": round(took_s * 1e3, 1)}
    if trial.corners is not None:
        ids = [found.ids]
        if not trial.target.has_one_way_up:
            ids.append(len(trial.corners) - 1 - found.ids)
        apart = [np.linalg.norm(found.xy_px - trial.corners[some], axis=1) for some in ids]
        error_px = min(apart, key=lambda one: float(one.max()))
        row["sigma_px"] = round(float(found.sigma_px.max()), 4)
        row["worst_px"] = round(float(error_px.max()), 3)
        row["rms_px"] = round(float(np.sqrt(np.mean(error_px**2) / 2)), 4)
        row["of"] = len(trial.corners)
    return row


def empty_rows(number: int, seed: int) -> list[Row]:
    """Two kinds of target asked of one picture."""
    return [judged(trial) for trial in without_board(number, seed)]


def wide_rows(number: int, seed: int) -> list[Row]:
    """A board of either kind in turns."""
    boards = CHARUCOS if number % 2 else CHECKERS
    return [judged(wide_board(number, seed, boards[number // 2 % len(boards)]))]


def faulty_rows(number: int, seed: int) -> list[Row]:
    """One fault, of either kind of board."""
    return [
        judged(faulty_board(number, seed, boards[number // 10 % len(boards)]))
        for boards in (CHECKERS, CHARUCOS)
    ]


PARTS: dict[str, Callable[[int, int], list[Row]]] = {
    "empty": empty_rows,
    "wide": wide_rows,
    "faulty": faulty_rows,
}


def kept(path: Path, seed: int) -> list[Row]:
    """What was judged before with this seed; a torn last line is left out."""
    if not path.exists():
        return []
    rows: list[Row] = []
    for line in path.read_text().splitlines():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return [row for row in rows if row["seed"] == seed]


def work(path: Path, seed: int, counts: dict[str, int], seconds: float) -> list[Row]:
    """Judge what is missing, as far as the time goes."""
    rows = kept(path, seed)
    done = {(row["part"], row["number"]) for row in rows}
    path.parent.mkdir(parents=True, exist_ok=True)
    until = time.monotonic() + seconds
    with path.open("a") as file:
        file.write("\n")  # What was torn off ends here.
        for part, number in _missing(counts, done):
            if time.monotonic() > until:
                break
            fresh = [
                row | {"part": part, "number": number, "seed": seed}
                for row in PARTS[part](number, seed)
            ]
            # Both rows of a picture in one write: a line that is missing is judged again.
            file.write("".join(json.dumps(row) + "\n" for row in fresh))
            file.flush()
            rows += fresh
    return rows


def _missing(counts: dict[str, int], done: set[tuple[str, int]]) -> Iterator[tuple[str, int]]:
    for number in range(max(counts.values())):
        for part, count in counts.items():
            if number < count and (part, number) not in done:
                yield part, number


def is_right(row: Row) -> bool:
    """Found where the truth has it."""
    if "worst_px" not in row:
        return False
    return row["worst_px"] < max(MOST_ERROR_PX, MOST_SIGMAS * row["sigma_px"])


def tables(rows: list[Row]) -> str:
    """Everything that the pages quote."""
    lines: list[str] = []
    for target in ("checkerboard", "charuco"):
        own = [row for row in rows if row["target"] == target]
        empty = [row for row in own if row["part"] == "empty"]
        false = [row for row in empty if "corners" in row]
        lines.append(f"{target}: {len(false)} false positives in {len(empty)} without a board")
        lines += [f"    {row['kind']} {row['number']}: {row['board']}" for row in false]
        wide = [row for row in own if row["part"] == "wide"]
        lines += _wide_lines(target, wide)
        lines += _fault_lines(target, [row for row in own if row["part"] == "faulty"])
        if own:
            spent = np.array([row["ms"] for row in own])
            lines.append(f"{target}: at most {spent.max():.0f} ms, median {np.median(spent):.0f}")
    return "\n".join(lines)


def _wide_lines(target: str, wide: list[Row]) -> list[str]:
    if not wide:
        return []
    good = [row for row in wide if is_right(row)]
    wrong = [row for row in wide if "corners" in row and not is_right(row)]
    missed = Counter(f"{row['kind']} {row['reason']}" for row in wide if "reason" in row)
    share = np.mean([row["corners"] / row["of"] for row in good]) if good else np.nan
    rms = np.median([row["rms_px"] for row in good]) if good else np.nan
    return [
        f"{target}: {len(good)} of {len(wide)} found through wide lenses "
        f"({len(good) / len(wide):.1%}), {len(wrong)} wrongly; of found boards {share:.1%} of the "
        f"corners, rms {rms:.3f} px",
        *(f"    missed {number} x {what}" for what, number in missed.most_common()),
        *(f"    wrong {row['number']}" for row in wrong),
    ]


def _fault_lines(target: str, faulty: list[Row]) -> list[str]:
    refused = [row for row in faulty if "reason" in row]
    if not refused:
        return []
    right = sum(row["right"] for row in refused)
    by_kind: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for row in faulty:
        answer = row.get("reason") or ("found" if is_right(row) else "found WRONGLY")
        by_kind[row["kind"]][answer] += 1
    return [
        f"{target}: {right} of {len(refused)} refused with a right reason "
        f"({right / len(refused):.1%})",
        *(
            f"    {kind}: " + ", ".join(f"{what} {n}" for what, n in answers.most_common())
            for kind, answers in by_kind.items()
        ),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--empty", type=int, default=2000)
    parser.add_argument("--wide", type=int, default=1000)
    parser.add_argument("--faulty", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=Path("build/boards.jsonl"))
    parser.add_argument("--seconds", type=float, default=240.0)
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    counts = {part: int(getattr(asked, part)) for part in PARTS}
    print(tables(work(asked.out, asked.seed, counts, asked.seconds)))


if __name__ == "__main__":
    main()
