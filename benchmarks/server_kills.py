"""`rig sweep` on a PostgreSQL server that is stopped as by a power cut, or rig killed, or both.

    python -m benchmarks.server_kills --count 200 --seed 1 --record server.jsonl

Every round has a database of its own. The moments are shares of the time that a sweep takes
undisturbed, drawn from seed and number alone. Then the server is there again, and the sweep is gone
on with and compared with an undisturbed one. With `--record` a second call goes on where the first
one ended. Exit code 1 where a promise was broken. Needs Debian's package postgresql.
"""

import argparse
import json
import os
import random
import shlex
import subprocess
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.failing_disk import begin_with_it
from benchmarks.kills.__main__ import LATEST, Whole, undisturbed, warm, workplace
from benchmarks.kills.taking import SweepTrial
from benchmarks.program import Ended, run_program
from tests.support.postgresql import Server, running_server

KINDS = ("rig", "server", "both")
"""What is stopped."""


@dataclass(frozen=True)
class Round:
    """One sweep that was disturbed."""

    number: int
    kind: str
    after_s: float
    code: int
    said: str
    broken: tuple[str, ...]


class ServerSweepTrial(SweepTrial):
    """`rig sweep` with its rows on a server."""

    def url(self, folder: Path) -> str:
        """See `Trial.url`."""
        del folder
        return self.server or ""


def play(server: Server, number: int, seed: int, whole: Whole) -> Round:
    """Take a sweep in a new database, stop something, and go on."""
    draw = random.Random(f"{seed} {number}")  # noqa: S311
    kind, after_s = draw.choice(KINDS), draw.random() * LATEST * whole.took_s
    name = f"round_{number}"
    trial = ServerSweepTrial(server.make_database(name))
    trial.wanted = whole.wanted
    with workplace() as folder:
        os.environ["RIG_FRAMES"] = str(folder / "frames")
        stopping = None if kind == "rig" else _stopped_after(server, after_s)
        kill_after_s = None if kind == "server" else after_s
        ended = run_program(trial.words(folder), folder, kill_after_s=kill_after_s)
        if stopping is not None:
            stopping.wait()
            server.start()
        broken = [*_said(ended, kind), *trial.broken(folder, ended)]
    server.run("dropdb", "-h", server.folder, "-U", "rig", name)
    last = ended.err.strip().splitlines()[-1:] or [""]
    return Round(number, kind, after_s, ended.code, last[0][:300], tuple(broken))


def _stopped_after(server: Server, after_s: float) -> "subprocess.Popen[bytes]":
    """Begin a process that stops the server after a while: at once, with nothing put in order."""
    stop = [*server.begin, str(server.programs / "pg_ctl"), "-D", str(server.folder / "data")]
    line = f"sleep {after_s:.3f}; exec {shlex.join([*stop, '-m', 'immediate', '-w', 'stop'])}"
    return subprocess.Popen(["sh", "-c", line], cwd=server.folder, stdout=subprocess.DEVNULL)


def _said(ended: Ended, kind: str) -> list[str]:
    """Look how a sweep ended whose server went away."""
    if kind != "server":
        return []
    lines = [line for line in ended.err.splitlines() if line.startswith("rig: ")]
    if ended.code not in (0, 1, 3):
        return [f"exit code {ended.code}: {ended.err[-300:]!r}"]
    if "Traceback" in ended.err:
        return [f"a traceback: {ended.err[-500:]!r}"]
    if ended.code == 1 and len(lines) != 1:
        return [f"{len(lines)} lines: {lines}"]
    return []


def main() -> int:
    """Play every round that is not on record yet, and say what came of them."""
    begin_with_it("benchmarks.server_kills", sys.argv[1:])
    parser = argparse.ArgumentParser(prog="python -m benchmarks.server_kills")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no round after these")
    parser.add_argument("--record", type=Path, help="file of JSON lines, continued")
    asked = parser.parse_args()
    rounds = _recorded(asked.record)
    until_s = time.monotonic() + 60.0 * asked.minutes
    with running_server() as server:
        trial = SweepTrial(None)
        warm(trial)
        whole = undisturbed(trial)
        while len(rounds) < asked.count and time.monotonic() < until_s:
            rounds.append(play(server, len(rounds), asked.seed, whole))
            if asked.record is not None:
                with asked.record.open("a") as file:
                    file.write(json.dumps(asdict(rounds[-1])) + "\n")
            for fault in rounds[-1].broken:
                print(f"{rounds[-1].number}, {rounds[-1].kind}: {fault}", flush=True)
    ends = Counter((played.kind, played.code) for played in rounds)
    print(f"{len(rounds)} sweeps, {sum(bool(played.broken) for played in rounds)} broken")
    print(", ".join(f"{kind} {code}: {count}" for (kind, code), count in sorted(ends.items())))
    return 1 if any(played.broken for played in rounds) else 0


def _recorded(record: Path | None) -> list[Round]:
    rounds: list[Round] = []
    if record is not None and record.exists():
        for line in record.read_text().splitlines():
            told = json.loads(line)
            rounds.append(Round(broken=tuple(told.pop("broken")), **told))
    return rounds


if __name__ == "__main__":
    sys.exit(main())
