"""`rig` in a process of its own that gets a signal at a known point of its work.

    python -m tests.support.signalled SIGNAL POINT [FAULT] -- ARGUMENTS OF RIG

A point is `import:MODULE` (before that module is read) or `call:MODULE:FUNCTION[:NTH]` (as its
N-th call begins). A fault is `stop` (every stop of the stage raises what no driver should).
"""

import importlib
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parents[2]
STILL, MOVING = "the carriage stands still", "the carriage moves"


@dataclass(frozen=True, slots=True)
class Ended:
    """How such a process ended."""

    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """What stderr says of the interrupt."""
        return [line for line in self.err.splitlines() if line.startswith("rig: ")]


def run_signalled(
    number: int, point: str, *arguments: str | Path, fault: str | None = None
) -> Ended:
    """Run `rig ARGUMENTS` and send it a signal at a point."""
    words = [str(int(number)), point, *([] if fault is None else [fault]), "--"]
    ended = subprocess.run(
        [sys.executable, "-m", "tests.support.signalled", *words, *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    return Ended(ended.returncode, ended.stdout, ended.stderr)


class _BeforeReading:
    """Sends the signal when a module is looked for."""

    def __init__(self, module: str, number: int) -> None:
        self._module = module
        self._number = number

    def find_spec(self, name: str, _path: object, _target: ModuleType | None = None) -> None:
        if name == self._module:
            sys.meta_path.remove(self)  # type: ignore[arg-type]
            os.kill(os.getpid(), self._number)


def _wrap(place: str, number: int) -> None:
    module_name, function, *nth = place.split(":")
    owner: Any = importlib.import_module(module_name)
    *outer, name = function.split(".")
    for part in outer:
        owner = getattr(owner, part)
    original = getattr(owner, name)
    left = [int(nth[0]) if nth else 1]

    def signalled(*args: Any, **named: Any) -> Any:
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), number)
        return original(*args, **named)

    setattr(owner, name, signalled)


def _break_stop() -> None:
    from rig_drivers.stage.serial_stage import SerialStage

    def stop(self: SerialStage) -> None:
        del self
        raise KeyError("no such\nregister")

    SerialStage.stop = stop


def watched_carriages() -> list[Any]:
    """Return a list that every simulated carriage of this process will be in, with its clock."""
    carriages: list[Any] = []
    from rig_sim.carriage import Carriage

    begin = Carriage.__init__

    def watched(self: Carriage, config: Any, clock: Any) -> None:
        begin(self, config, clock)
        carriages.append((self, clock))

    Carriage.__init__ = watched
    return carriages


def way_they_go(carriages: Sequence[Any]) -> list[str]:
    """Say of each carriage whether it stands still."""
    said: list[str] = []
    for carriage, clock in carriages:
        now_s = clock.now_s()
        way_mm = carriage.travelled_mm(now_s + 1.0) - carriage.travelled_mm(now_s + 30.0)
        said.append(STILL if abs(way_mm) < 1e-6 else MOVING)
    return said


def main(words: Sequence[str]) -> None:
    """Prepare the point, and run."""
    split = words.index("--")
    number, point, *faults = words[:split]
    sys.argv = ["rig", *words[split + 1 :]]
    carriages: list[Any] = []
    kind, _, place = point.partition(":")
    if kind == "call":
        carriages = watched_carriages()
        _wrap(place, int(number))
    else:
        sys.meta_path.insert(0, _BeforeReading(place, int(number)))  # type: ignore[arg-type]
    if "stop" in faults:
        _break_stop()
    from rig.cli import main as rig_main

    try:
        rig_main()
    finally:
        for line in way_they_go(carriages):
            sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main(sys.argv[1:])
