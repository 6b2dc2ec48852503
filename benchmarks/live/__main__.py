"""Print times of live frames. Run `python -m benchmarks.live` (all), or name parts of `PARTS`."""

import argparse
import os
import sys
from collections.abc import Callable

import numpy as np

from benchmarks.live.estimator import estimator, threads
from rig.compute.cores import threads as threads_used

PARTS: dict[str, tuple[str, Callable[[], None]]] = {
    "estimator": ("Slopes, beside OpenCV on the widest pair of the same frames", estimator),
    "threads": ("Slopes on one thread and on two", threads),
}
_ALL = ("estimator",)
"""What is run without a name; it holds the other part."""


def main(wanted: list[str]) -> None:
    if unknown := set(wanted) - set(PARTS):
        sys.exit(f"no part {', '.join(sorted(unknown))}; there are: {', '.join(PARTS)}")
    busy = f"{threads_used()} threads; load of the machine {os.getloadavg()[0]:.1f}"
    print(f"{busy}: where it is above 1, wall times say little, cpu times and ratios more")
    for name in wanted or _ALL:
        title, run = PARTS[name]
        print(f"\n# {title}", flush=True)
        run()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.live", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="NAME", help="parts to run; all by default")
    arguments = parser.parse_args()
    np.seterr(invalid="ignore")
    main(arguments.parts)
