"""Runs a kernel over bands of rows (or labels, or columns) on two threads, the caller's among them.

Kernels release the interpreter lock, so plain threads do. Each index is computed by the same code
whatever the split, which keeps results bit-identical; and, unlike numba's own thread pool, this one
may be entered by several callers at once and costs no compile time.
"""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import pairwise
from typing import TypeVar, cast

Result = TypeVar("Result")

THREADS = 2
_here = threading.local()
_pool = ThreadPoolExecutor(THREADS - 1, thread_name_prefix="slopes")


def run_in_bands(work: Callable[[int, int], None], count: int) -> None:
    """Call `work(start, stop)` for bands that cover `range(count)`, and wait for all.

    Work that itself asks for bands gets one: both threads are busy, and would wait for each other.
    """
    if getattr(_here, "is_working", False):
        work(0, count)
        return
    edges = [count * i // THREADS for i in range(THREADS + 1)]
    first, *others = pairwise(edges)
    futures = [_pool.submit(_work, work, *band) for band in others]
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
    """Call each, on two threads, and return what they returned in their order."""
    results: list[Result | None] = [None] * len(works)

    def work(start: int, stop: int) -> None:
        results[start:stop] = [one() for one in works[start:stop]]

    run_in_bands(work, len(works))
    return cast("list[Result]", results)
