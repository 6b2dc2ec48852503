"""One output on a thread of its own, behind a bounded queue."""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from rig.capture.output import Output
from rig.capture.spread import Spread, SpreadTally
from rig.errors import OutputError, RigError
from rig.live.frame import DepthFrame

PATIENCE_S = 30.0
"""An output that takes longer for one frame, or to close, hangs: a file server that is gone."""
_SLICE_S = 0.2
"""A Ctrl-C that comes right before a wait is noticed after it only."""


@dataclass(frozen=True, slots=True)
class OutputSummary:
    """What became of one output."""

    name: str
    is_kept: bool
    """See `WantedOutput.is_kept`."""
    written: int
    """Frames that it took."""
    dropped: int
    """Frames that it was too slow for, or that were lost when it failed or came later."""
    latency_s: Spread
    """From mid-exposure until it had taken a frame."""
    failure: RigError | None
    """Why it ended before the capture did, or is not whole."""


class OutputThread:
    """Hands frames to one output, in their order, and never lets it slow whoever brings them.

    Args:
        output: open.
        is_kept: see `WantedOutput.is_kept`.
        room: how many frames may wait for it.
        waits: whether a full queue makes `offer` wait; otherwise the oldest frame in it is dropped.
        patience_s: after so long without an answer the output is given up.
        clock_s: by which that is counted.
    """

    def __init__(
        self,
        output: Output,
        *,
        is_kept: bool,
        room: int,
        waits: bool,
        patience_s: float = PATIENCE_S,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name = output.name
        self._output = output
        self._is_kept = is_kept
        self._room = room
        self._waits = waits
        self._patience_s = patience_s
        self._clock_s = clock_s
        self._news = threading.Condition()
        self._frames: deque[tuple[DepthFrame, float]] = deque()
        self._latency_s = SpreadTally()
        self._is_ending = False
        self._is_done = False
        self._is_writing = False
        self._offered = 0
        self._written = 0
        self._failure: RigError | None = None
        self._fault: BaseException | None = None
        self._since_s: float | None = None
        self._thread = threading.Thread(target=self._run, name=f"output {self.name}", daemon=True)
        self._thread.start()

    @property
    def failure(self) -> RigError | None:
        """Why it takes no frames any more."""
        with self._news:
            return self._failure

    @property
    def summary(self) -> OutputSummary:
        """What it did so far."""
        with self._news:
            missed = self._offered - self._written - len(self._frames) - self._is_writing
            return OutputSummary(
                self.name,
                self._is_kept,
                written=self._written,
                dropped=missed,
                latency_s=self._latency_s.spread,
                failure=self._failure,
            )

    def offer(self, frame: DepthFrame) -> None:
        """Queue one frame; drop and count the oldest where there is no room."""
        with self._news:
            self._require_sound()
            self._offered += 1
            if self._waits:
                self._wait_until(lambda: len(self._frames) < self._room or self._has_failed)
            self._patience_left_s()
            if self._has_failed:
                return
            if len(self._frames) >= self._room:
                self._frames.popleft()
            self._frames.append((frame, self._clock_s()))
            self._news.notify_all()

    def end(self) -> None:
        """Let it take what still waits and close it; does not wait for that."""
        with self._news:
            self._is_ending = True
            self._news.notify_all()

    def wait(self) -> None:
        """Wait until it has ended, or is given up."""
        with self._news:
            self._wait_until(lambda: self._is_done)

    def finish(self) -> OutputSummary:
        """End it, wait for that, and say what it did."""
        self.end()
        self.wait()
        with self._news:
            self._require_sound()
        return self.summary

    @property
    def _has_failed(self) -> bool:
        return self._failure is not None or self._fault is not None

    def _require_sound(self) -> None:
        if self._fault is not None:  # no error of rig's: a mistake in the output, never hidden
            raise self._fault

    def _wait_until(self, is_met: Callable[[], bool]) -> None:
        while not is_met():
            left_s = self._patience_left_s()
            if left_s <= 0.0:
                return
            self._news.wait(min(left_s, _SLICE_S))

    def _patience_left_s(self) -> float:
        """Give the output up that has been busy for too long; return how long it still may be."""
        busy_s = 0.0 if self._since_s is None else self._clock_s() - self._since_s
        if busy_s >= self._patience_s and not self._is_done:
            waiting = len(self._frames)
            self._fail(
                OutputError(
                    f"output {self.name}: no answer within {self._patience_s:g} s, given up with "
                    f"{waiting} frame{'' if waiting == 1 else 's'} waiting",
                    advice="is the disk, or the machine at the other end, still there?",
                )
            )
            self._is_done = True
        return self._patience_s - busy_s

    def _fail(self, error: RigError) -> None:
        self._failure = self._failure or error
        self._is_writing = False
        self._frames.clear()

    def _run(self) -> None:
        while (waiting := self._next()) is not None:
            frame, offered_s = waiting
            if self._guarded(lambda frame=frame: self._output.write(frame)):
                with self._news:
                    self._written += 1
                    self._is_writing = False
                    self._latency_s.add(frame.latency_s + self._clock_s() - offered_s)
        self._guarded(self._output.close)
        with self._news:
            self._since_s = None
            self._is_done = True
            self._news.notify_all()

    def _next(self) -> tuple[DepthFrame, float] | None:
        """Wait for the next frame; None where there will be none."""
        with self._news:
            self._since_s = None
            self._news.notify_all()
            self._news.wait_for(lambda: self._frames or self._is_ending or self._has_failed)
            self._since_s = self._clock_s()
            if self._has_failed or not self._frames:
                return None
            self._is_writing = True
            return self._frames.popleft()

    def _guarded(self, work: Callable[[], None]) -> bool:
        """Do it; return whether it went well."""
        try:
            work()
        except RigError as error:
            with self._news:
                self._fail(error)
        except BaseException as error:
            with self._news:
                self._fault = self._fault or error
        else:
            return True
        return False
