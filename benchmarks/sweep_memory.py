"""Memory of a long sweep whose camera is quicker than the estimator.

    python -m benchmarks.sweep_memory --samples 400
    python -m benchmarks.sweep_memory --samples 400 --held 100000

Resident memory is read as each sample is stored; printed are the first reading behind the warm-up,
the last, the highest, and how many samples were measured by then. `--held` is how many samples wait
with their pictures in memory; without, as the program has it.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.live_memory import resident_mb
from rig.cli import main
from rig.database import Store
from rig.sweep import measuring_thread
from tests.support.small_sim import SMALL_SIM, as_options
from tests.support.stores import sqlite_url

STOPS = ("400", "500", "650", "900", "1200")
WARM_UP = 20
"""Samples: kernels are read, caches filled."""


def watched(readings_mb: list[float]) -> None:
    """Let every stored sample add a reading."""
    add_sample: Any = Store.add_sample

    def added(self: Store, sweep_id: int, **named: Any) -> Any:
        sample = add_sample(self, sweep_id, **named)
        readings_mb.append(resident_mb())
        return sample

    Store.add_sample = added


def run() -> int:
    """Sweep, and print what memory did."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sweep_memory")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--held", type=int)
    asked = parser.parse_args()
    if asked.held is not None:
        measuring_thread.MOST_HELD = asked.held  # type: ignore[misc]
    readings_mb: list[float] = []
    watched(readings_mb)
    each = str(asked.samples // len(STOPS))
    stops = ("--at-mm", ",".join(STOPS), "--samples", each)
    even = ("--set", "sweep.holdout_every=0", "--set", "sweep.backward_every=0")
    code: int | str | None = None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ.pop("RIG_FRAMES", None)
        words = ("sweep", "sim", *as_options(SMALL_SIM), *even, *stops, "--db", sqlite_url(folder))
        sys.argv = ["rig", *words]
        try:
            main()
        except SystemExit as ended:
            code = ended.code
    after = readings_mb[WARM_UP:]
    print(
        f"{len(readings_mb)} samples, {measuring_thread.MOST_HELD} held at most: behind "
        f"{WARM_UP} {after[0]:.0f} MB, last {after[-1]:.0f} MB, highest {max(after):.0f} MB"
    )
    return 0 if code in (0, 3) else 1


if __name__ == "__main__":
    sys.exit(run())
