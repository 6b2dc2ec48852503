"""Runs a kernel over bands of rows (or labels, or columns) on all cores, the caller's thread first.

Kernels release the interpreter lock, so plain threads do. Each index is computed by the same code
whatever the split, which keeps results bit-identical on any number of threads; and, unlike numba's
own thread pool, this one may be entered by several callers at once and costs no compile time.
"""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise
from typing import TypeVar, cast

from rig.compute.cores import threads

Result = TypeVar("Result")

_here = threading.local()


@cache
def _pool(others: int) -> ThreadPoolExecutor:
    """The threads beside the caller's. They start when there is work, and wait for more."""
    return ThreadPoolExecutor(others, thread_name_prefix="slopes")


def run_in_bands(work: Callable[[int, int], None], count: int) -> None:
    """Call `work(start, stop)` for bands that cover `range(count)`, and wait for all.

    There are as many bands as threads, but never an empty one. Work that itself asks for bands
    gets one: all threads are busy, and would wait for each other.

    Raises:
        ConfigError: `RIG_THREADS` is no number of threads.
    """
    bands = 1 if getattr(_here, "is_working", False) else min(threads(), count)
    if bands <= 1:
        work(0, count)
        return
    first, *others = pairwise(count * i // bands for i in range(bands + 1))
    pool = _pool(threads() - 1)
    futures = [pool.submit(_work, work, *band) for band in others]
    try:
        _work(work, *first)
    finally:
        wait(futures)  # whatever happens, nothing of this call runs on
    for future in futures:
        future.result()


def _work(work: Callable[[int, int], None], start: int, stop: int) -> None:
    _here.is_working = True
    try:
        work(start, stop)
    finally:
        _here.is_working = False


def run_side_by_side(*works: Callable[[], Result]) -> list[Result]:
    """Call each, spread over the threads, and return what they returned in their order."""
    results: list[Result | None] = [None] * len(works)

    def work(start: int, stop: int) -> None:
        results[start:stop] = [one() for one in works[start:stop]]

    run_in_bands(work, len(works))
    return cast("list[Result]", results)
