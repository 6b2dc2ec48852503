"""Times of several ways to do one thing, in turn and in one process, with what a thread costs."""

import os
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median

import cv2

from rig.compute import bands
from rig.compute.cores import VARIABLE


@dataclass(frozen=True)
class Times:
    """Medians of what one way took, ms."""

    wall_ms: float
    cpu_ms: float
    """Processor time, all threads together."""
    caller_ms: float
    """Processor time of the calling thread alone."""


def serial_share(run: Callable[[], object], rounds: int) -> float:
    """Share of the processor time that is spent outside of what threads share, hand-overs included.

    Unlike wall times, and unlike what each thread does (whoever is free takes the next band), that
    hardly depends on what else the machine is doing.
    """
    shared_s: list[float] = []  # appending is safe from several threads
    plain = bands.do_band

    def timed(work: Callable[[int, int], None], start: int, stop: int) -> None:
        begun = time.thread_time()
        plain(work, start, stop)
        shared_s.append(time.thread_time() - begun)

    bands.do_band = timed
    try:
        begun = time.process_time()
        for _ in range(rounds):
            run()
        whole_s = time.process_time() - begun
    finally:
        bands.do_band = plain
    return 1.0 - sum(shared_s) / whole_s


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
