"""Times of several ways to do one thing, fair on a machine that is busy with other things."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median


@dataclass(frozen=True)
class Times:
    """What one way took, ms."""

    wall_ms: float
    """Shortest of all rounds: what disturbs only adds."""
    cpu_ms: float
    """Median processor time, all threads together."""


def race(ways: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, Times]:
    """Run all ways in turn, `rounds` times, after one round to warm up."""
    wall: dict[str, list[float]] = {name: [] for name in ways}
    cpu: dict[str, list[float]] = {name: [] for name in ways}
    for k in range(rounds + 1):
        for name, run in ways.items():
            start, start_cpu = time.perf_counter(), time.process_time()
            run()
            if k > 0:
                wall[name].append(1e3 * (time.perf_counter() - start))
                cpu[name].append(1e3 * (time.process_time() - start_cpu))
    return {name: Times(min(wall[name]), median(cpu[name])) for name in ways}
