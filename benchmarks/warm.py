"""What makes a forked `rig` quick: all that it would compute alike in every round is there before.

The verb is the real one, with its files, rows, threads, locks and signals. Modules and kernels are
read before the fork; noise-free pictures of the simulated world are kept by moment; a report is
written without its drawings, which are arithmetic that touches no disk.
"""

import importlib
import io
import os
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any

import cv2
from rig_sim.pictures import Exposures

from rig.cli import main
from rig.report import figures

_MODULES = (
    "calibrate.calibrate", "capture.on_rig", "cli.verbs", "report.calibration.page", "report.page",
    "store.backup", "store.migrate", "store.move", "store.prune", "store.repair", "store.restore",
    "store.usage", "sweep.measure_again", "sweep.sweep",
)  # fmt: skip


def _undrawn(name: str, description: str, height_in: float, draw: object) -> str:
    del description, height_in, draw
    return f'<svg id="{name}"></svg>'


def _no_epis(*_: object) -> list[object]:
    return []


def _keep_pictures() -> None:
    kept: dict[tuple[str, Any, float], Any] = {}
    exposures: Any = Exposures
    expose = exposures._expose  # noqa: SLF001

    def exposed(self: Any, moment: Any, lamp: float) -> Any:
        key = (repr((self._world.config, self._tint)), moment, lamp)
        if key not in kept:
            kept[key] = expose(self, moment, lamp)
        return kept[key]

    exposures._expose = exposed  # noqa: SLF001


@cache
def make_ready() -> None:
    """Do it once, and never by being imported: this program is no longer good for anything else."""
    figures.draw_svg = _undrawn  # before the modules that import it by name
    for module in _MODULES:
        importlib.import_module(f"rig.{module}")
    importlib.import_module("rig.report.page").board_epis = _no_epis  # type: ignore[attr-defined]
    _keep_pictures()
    # Threads of a pool do not come along when a process forks: all works in the caller's.
    os.environ["RIG_THREADS"] = "1"
    cv2.setNumThreads(1)


def warm_up(words: Sequence[str | Path], code: Sequence[int] = (0, 3)) -> None:
    """Run `rig WORDS` here, so that every later process finds what it needs in memory.

    Raises:
        SystemExit: it ends with another exit code.
        RuntimeError: it left a thread, which no forked process would have.
    """
    make_ready()
    before, here = sys.argv, Path.cwd()
    out = io.StringIO()
    sys.argv = ["rig", *map(str, words)]
    ended: int | str | None = 0
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(out), redirect_stderr(out):
        os.chdir(folder)
        try:
            main()
        except SystemExit as error:
            ended = error.code
        finally:
            os.chdir(here)
            sys.argv = before
    if ended not in code:
        raise SystemExit(f"rig {words[0]} ends with {ended}: {out.getvalue()}")
    left = [thread.name for thread in threading.enumerate() if thread.name != "MainThread"]
    if left:
        raise RuntimeError(f"rig {words[0]} leaves threads: {left}")
