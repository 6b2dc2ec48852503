"""Times of several ways to do one thing, in turn and in one process, with what a thread costs."""

import os
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median

import cv2

from rig.compute.cores import VARIABLE


@dataclass(frozen=True)
class Times:
    """Medians of what one way took, ms."""

    wall_ms: float
    cpu_ms: float
    """Processor time, all threads together."""
    caller_ms: float
    """Processor time of the calling thread alone."""

    def serial_share(self, threads: int) -> float:
        """Share of the work that one thread does while the others wait (G. Amdahl, 1967).

        The caller does all of the serial part s and its band of the rest: caller = s + p / n and
        cpu = s + p. Unlike wall times, processor times tell it on a machine that others use too.
        """
        serial_ms = (threads * self.caller_ms - self.cpu_ms) / (threads - 1)
        return min(max(serial_ms / self.cpu_ms, 0.0), 1.0)


def speed_up(serial_share: float, threads: int) -> float:
    """How many times faster that many threads are than one, by Amdahl's law."""
    return 1.0 / (serial_share + (1.0 - serial_share) / threads)


def race(ways: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, Times]:
    """Run all ways in turn, `rounds` times, after two rounds to warm up."""
    clocks = time.perf_counter, time.process_time, time.thread_time
    taken: dict[str, list[list[float]]] = {name: [] for name in ways}
    for k in range(rounds + 2):
        for name, run in ways.items():
            begun = [clock() for clock in clocks]
            run()
            if k > 1:
                ends = zip(clocks, begun, strict=True)
                taken[name].append([1e3 * (clock() - start) for clock, start in ends])
    return {
        name: Times(*(median(column) for column in zip(*rows, strict=True)))
        for name, rows in taken.items()
    }


@contextmanager
def on_threads(count: int) -> Generator[None]:
    """Share the work among that many threads, ours and OpenCV's."""
    before, before_cv2 = os.environ.get(VARIABLE), cv2.getNumThreads()
    os.environ[VARIABLE] = str(count)
    cv2.setNumThreads(count)
    try:
        yield
    finally:
        cv2.setNumThreads(before_cv2)
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before
