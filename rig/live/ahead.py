"""Rectifies the next multi-view while the last one becomes depth."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager
from queue import SimpleQueue

from rig.live.measure import Rectified
from rig.live.taking import Taken, Taking


class Ahead:
    """Gives rectified multi-views, in their order.

    Args:
        taking: where they come from.
        rectify: called on a thread of its own where multi-views are taken ahead.
        count: told `estimate` of each multi-view that was rectified and is not the newest any more.
    """

    def __init__(
        self,
        taking: Taking,
        rectify: Callable[[Taken], Rectified],
        count: Callable[[str], None],
    ) -> None:
        self._taking = taking
        self._rectify = rectify
        self._count = count
        self._begun: Future[Rectified | None] | None = None
        self._asked: SimpleQueue[Future[Rectified | None] | None] = SimpleQueue()
        self._is_over = threading.Event()
        self._thread: threading.Thread | None = None
        if taking.runs_ahead:
            self._thread = threading.Thread(target=self._run, name="rectify", daemon=True)
            self._thread.start()

    def begin(self) -> None:
        """Begin with the next one, where that is possible and not done yet."""
        if self._thread is not None and self._begun is None:
            self._begun = Future()
            self._asked.put(self._begun)

    def next(self) -> Rectified | None:
        """Wait for the next one; None after the last one.

        Raises:
            DeviceError: see `Camera.stream`.
            SlopeError: the pictures do not fit the calibration.
        """
        if self._begun is not None:
            found = self._begun.result()
            self._begun = None
            if found is None or not self._taking.is_stale(found.taken):
                return found
            self._count("estimate")
        return self._next()

    def next_taken(self) -> Taken | None:
        """Wait for the next one as it was taken; see `next`."""
        if self._begun is None:
            return self._taking.next()
        found = self._begun.result()
        self._begun = None
        return None if found is None else found.taken

    def paused(self, timeout_s: float) -> AbstractContextManager[bool]:
        """See `Taking.paused`."""
        return self._taking.paused(timeout_s)

    @property
    def is_over(self) -> bool:
        """Whether nobody asks any more."""
        return self._is_over.is_set()

    def wake(self) -> None:
        """Let `next` return None, also where it waits; from any thread."""
        self._is_over.set()
        self._taking.wake()

    def stop(self) -> list[Taken]:
        """Leave the stream and end the thread; return what was taken and is not used."""
        self.wake()
        if self._thread is not None:
            self._asked.put(None)
            self._thread.join()
        left = self._taking.stop()
        if self._begun is not None and self._begun.exception() is None:
            found = self._begun.result()
            left = [*([] if found is None else [found.taken]), *left]
        self._begun = None
        return left

    def _next(self) -> Rectified | None:
        taken = self._taking.next()
        return None if taken is None else self._rectify(taken)

    def _run(self) -> None:
        while (future := self._asked.get()) is not None:
            try:
                future.set_result(self._next())
            except BaseException as error:
                future.set_exception(error)
