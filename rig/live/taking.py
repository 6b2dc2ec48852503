"""Taking multi-views out of a stream: on a thread of its own, or when they are asked for."""

import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass
from typing import Protocol

from rig.frames import MultiView


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A multi-view, and when the camera handed it over."""

    views: MultiView
    age_s: float
    """From the middle of the exposure until it was handed over, on the clock of the camera."""
    time_ns: int
    """See `DepthFrame.time_ns`."""
    handed_over_s: float
    """When that was, by `time.perf_counter`."""


@dataclass(frozen=True, slots=True)
class Rules:
    """What is done with each multi-view of a stream."""

    stamp: Callable[[MultiView], Taken]
    """Called the moment that the camera hands it over."""
    max_skew_s: float
    """Those with more skew are left out."""
    count: Callable[[str], None]
    """Told the reason why one is left out."""

    def taken(self, multiviews: Iterable[MultiView]) -> Iterator[Taken]:
        """Yield what is not left out."""
        for multiview in multiviews:
            if multiview.skew_s > self.max_skew_s:
                self.count("skew")
            else:
                yield self.stamp(multiview)


class Taking(Protocol):
    """Gives the multi-views of one stream."""

    runs_ahead: bool
    """Whether it takes them before they are asked for."""

    def next(self) -> Taken | None:
        """Wait for one; None after the last one, and once it was stopped.

        Raises:
            DeviceError: see `Camera.stream`.
        """
        ...

    def is_stale(self, taken: Taken) -> bool:
        """Whether the camera has given a newer one than the one that follows."""
        ...

    def paused(self, timeout_s: float) -> AbstractContextManager[bool]:
        """Leave the device alone for the time of a block; tell whether it came free in time."""
        ...

    def wake(self) -> None:
        """Let `next` return None, also where it waits; from any thread."""
        ...

    def stop(self) -> list[Taken]:
        """Leave the stream; return what was taken and is not used."""
        ...


class TakingOnDemand:
    """Takes a multi-view when it is asked for.

    For simulated time, which passes only while somebody waits: a thread that takes ahead would let
    it run away.
    """

    runs_ahead = False

    def __init__(self, stream: Generator[MultiView], rules: Rules) -> None:
        self._stream = stream
        self._taken = rules.taken(stream)
        self._is_over = threading.Event()

    def next(self) -> Taken | None:
        """See `Taking.next`."""
        try:
            return next(self._taken, None)
        except Exception:
            if self._is_over.is_set():  # nobody waits for it any more
                return None
            raise

    def is_stale(self, taken: Taken) -> bool:
        """See `Taking.is_stale`."""
        del taken
        return False

    def paused(self, timeout_s: float) -> AbstractContextManager[bool]:
        """See `Taking.paused`."""
        del timeout_s
        return nullcontext(True)

    def wake(self) -> None:
        """See `Taking.wake`."""
        self._is_over.set()

    def stop(self) -> list[Taken]:
        """See `Taking.stop`."""
        self._stream.close()
        return []


class TakingThread:
    """Takes multi-views on a thread of its own, so that the driver never waits for anything.

    Args:
        stream: is closed by this thread.
        rules: for each multi-view.
        room: how many may wait to be used.
        waits: whether a full queue makes the stream wait, which is then stored; otherwise the
            oldest is dropped and counted as `estimate`.
        before: come first.
    """

    runs_ahead = True

    def __init__(
        self,
        stream: Generator[MultiView],
        rules: Rules,
        *,
        room: int,
        waits: bool,
        before: Iterable[Taken] = (),
    ) -> None:
        self._stream = stream
        self._rules = rules
        self._waits = waits
        self._room = room
        self._news = threading.Condition()
        self._queue = deque(before)
        self._newest: Taken | None = None
        self._last_but_one: Taken | None = None
        self._is_over = False
        self._has_ended = False
        self._error: BaseException | None = None
        self._device = threading.Lock()
        self._is_free = threading.Event()
        self._is_free.set()
        self._thread = threading.Thread(target=self._run, name="take", daemon=True)
        self._thread.start()

    def next(self) -> Taken | None:
        """See `Taking.next`."""
        with self._news:
            self._news.wait_for(lambda: self._queue or self._has_ended or self._is_over)
            if self._is_over:
                return None
            if self._queue:
                taken = self._queue.popleft()
                self._news.notify_all()
                return taken
            if self._error is not None:
                raise self._error
            return None

    def is_stale(self, taken: Taken) -> bool:
        """See `Taking.is_stale`."""
        with self._news:
            is_recent = taken is self._newest or taken is self._last_but_one
        return not self._waits and not is_recent

    @contextmanager
    def paused(self, timeout_s: float) -> Generator[bool]:
        """See `Taking.paused`; waits for the multi-view that is being taken."""
        self._is_free.clear()
        came_free = False
        try:
            came_free = self._device.acquire(timeout=timeout_s)
            yield came_free
        finally:
            if came_free:
                self._device.release()
            self._is_free.set()

    def wake(self) -> None:
        """See `Taking.wake`."""
        with self._news:
            self._is_over = True
            self._news.notify_all()

    def stop(self) -> list[Taken]:
        """See `Taking.stop`; waits for the multi-view that is being taken."""
        self.wake()
        self._thread.join()
        return list(self._queue)

    def _run(self) -> None:
        try:
            with closing(self._stream):
                self._take_all()
        except BaseException as error:
            self._error = error
        with self._news:
            self._has_ended = True
            self._news.notify_all()

    def _take_all(self) -> None:
        taken = self._rules.taken(self._stream)
        while not self._is_over:
            self._is_free.wait()
            with self._device:
                one = next(taken, None)
            if one is None:
                return
            self._put(one)

    def _put(self, taken: Taken) -> None:
        with self._news:
            if self._waits:
                self._news.wait_for(lambda: len(self._queue) < self._room or self._is_over)
            elif len(self._queue) >= self._room:
                self._queue.popleft()
                self._rules.count("estimate")
            self._queue.append(taken)
            self._last_but_one, self._newest = self._newest, taken
            self._news.notify_all()
