"""Runs a kernel over bands of rows (or labels, or columns) on all cores, the caller's thread first.

Kernels release the interpreter lock, so plain threads do. Each index is computed by the same code
whatever the split, which keeps results bit-identical on any number of threads; and, unlike numba's
own thread pool, this one may be entered by several callers at once and costs no compile time.

There are more bands than threads, and who is free takes the next one (P. Tang and P.-C. Yew,
"Processor self-scheduling for multiple-nested parallel loops", ICPP 1986): a thread that wakes
late, or whose core has other things to do, delays nobody. The caller waits only for bands that
others are in the middle of.
"""

import os
import threading
from collections.abc import Callable
from itertools import pairwise
from queue import SimpleQueue
from typing import TypeVar, cast

from rig.compute.cores import threads

Result = TypeVar("Result")
Other = TypeVar("Other")
Work = Callable[[int, int], None]

_BANDS_A_THREAD = 3
"""Enough that whoever is late leaves little behind, few enough that their number costs nothing."""

_here = threading.local()


class _Job:
    """Bands that several threads take one after the other."""

    def __init__(self, work: Work, edges: list[int]) -> None:
        self._work: Work | None = work
        self._bands = list(pairwise(edges))
        self._next = 0
        self._lent = 0
        self._mutex = threading.Lock()
        self._returned = threading.Lock()
        self._error: BaseException | None = None

    def lead(self) -> None:
        """Take bands until none is left; return when no other thread is in the middle of one."""
        try:
            while (taken := self._taken()) is not None:
                do_band(*taken)
        finally:
            self._close()  # whatever happens, nothing of this call runs on
        if self._error is not None:
            raise self._error

    def help(self) -> None:
        """Take bands until none is left; the leader tells of what goes wrong."""
        while (taken := self._taken(lent=1)) is not None:
            try:
                do_band(*taken)
            except BaseException as error:
                self._error = error
            with self._mutex:
                self._lent -= 1
                if self._work is None and self._lent == 0:
                    self._returned.release()

    def _taken(self, lent: int = 0) -> tuple[Work, int, int] | None:
        with self._mutex:
            if self._work is None or self._next == len(self._bands):
                return None
            band = self._bands[self._next]
            self._next += 1
            self._lent += lent
            return self._work, *band

    def _close(self) -> None:
        """Lend no more bands, and wait for those that are lent."""
        with self._mutex:
            # Who comes late finds nothing to do, and holds no arrays in memory.
            self._work = None
            if self._lent == 0:
                return
            self._returned.acquire()
        self._returned.acquire()


class _Helpers:
    """The threads beside the callers'. They start when there is work, and wait for more."""

    def __init__(self) -> None:
        self._jobs: SimpleQueue[_Job] = SimpleQueue()
        self._mutex = threading.Lock()
        self._started = 0

    def call(self, job: _Job, count: int) -> None:
        """Ask so many threads to help with a job."""
        if self._started < count:
            self._start(count)
        for _ in range(count):
            self._jobs.put(job)

    def _start(self, count: int) -> None:
        with self._mutex:
            for number in range(self._started, count):
                name = f"slopes_{number}"
                threading.Thread(target=self._serve, name=name, daemon=True).start()
            self._started = max(self._started, count)

    def _serve(self) -> None:
        while True:
            self._jobs.get().help()


_helpers = _Helpers()


def _begin_anew() -> None:
    """A process that was forked has none of the threads of its parent."""
    global _helpers  # noqa: PLW0603
    _helpers = _Helpers()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_begin_anew)


def run_in_bands(work: Work, count: int) -> None:
    """Call `work(start, stop)` for bands that cover `range(count)`, and wait for all.

    There are a few bands for each thread, but never an empty one. Work that itself asks for bands
    gets one: all threads are busy, and would wait for each other.

    Raises:
        ConfigError: `RIG_THREADS` is no number of threads.
    """
    others = 0 if getattr(_here, "is_working", False) else min(threads(), count) - 1
    if others < 1:
        work(0, count)
        return
    bands = min(_BANDS_A_THREAD * (others + 1), count)
    job = _Job(work, [count * i // bands for i in range(bands + 1)])
    _helpers.call(job, others)
    job.lead()


def do_band(work: Work, start: int, stop: int) -> None:
    """Call `work(start, stop)`, which gets one band for all that it asks to be shared itself."""
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


def run_both(one: Callable[[], Result], other: Callable[[], Other]) -> tuple[Result, Other]:
    """Call both, on two threads if there are, and return what they returned."""
    works: tuple[Callable[[], object], ...] = (one, other)
    results = run_side_by_side(*works)
    return cast("Result", results[0]), cast("Other", results[1])
