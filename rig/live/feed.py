"""The multi-views of an opened device: for loops, and for grabs within and between them."""

import time
from collections import Counter, deque
from collections.abc import Callable, Mapping

from rig.devices import Camera, Clock, SystemClock
from rig.errors import CaptureTimeoutError
from rig.frames import MultiView
from rig.live.again import Reopening
from rig.live.ahead import Ahead
from rig.live.measure import Rectified, rectified
from rig.live.taking import Rules, Taken, TakingOnDemand, TakingThread
from rig.stored import Run

_READ_AHEAD = 2
"""Stored multi-views that wait to be rectified."""


class Feed:
    """Takes and rectifies multi-views ahead of a loop, and gives up what nobody waits for.

    Args:
        run: what the rig uses.
        device: open.
        clock: of its times.
        utc_ns: this machine's wall clock.
    """

    def __init__(self, run: Run, device: Camera, clock: Clock, utc_ns: Callable[[], int]) -> None:
        config = run.profile.camera
        self._run = run
        self._device = device
        self._clock = clock
        self._utc_ns = utc_ns
        self._is_stored = config.is_stored
        self._is_over = False
        # What is stored does not go away: begun anew it would give its first pictures again.
        reconnect_s = 0.0 if self._is_stored else config.reconnect_s
        self._reopening = Reopening(
            device, clock, reconnect_s=reconnect_s, is_over=self._is_left_alone
        )
        self._loops = 0
        self._ahead: Ahead | None = None
        self._left: deque[Taken] = deque()
        self._left_out: Counter[str] = Counter()
        self.waited_s = 0.0
        """How long loops have waited for the camera: for pictures, or for the simulation of them.
        """

    @property
    def can_wait(self) -> bool:
        """Whether nothing is lost while nobody asks: pictures are stored, or time is simulated."""
        return self._is_stored or not isinstance(self._clock, SystemClock)

    @property
    def dropped(self) -> Mapping[str, int]:
        """How many multi-views were dropped so far, by reason."""
        total = Counter({"skew": 0})
        for part in (self._reopening.dropped, self._left_out):
            total.update(part)
        return dict(total)

    def begin_loop(self) -> None:
        """Begin to take; loops of one thread that are begun within each other share the frames."""
        self._ahead = self._ahead or self._taking_ahead()
        self._loops += 1

    def end_loop(self) -> bool:
        """End a loop; return whether it was the last one, with which the threads end."""
        self._loops -= 1
        if not self._loops:
            self.stop()
        return not self._loops

    def next(self) -> Rectified | None:
        """Wait for the next one of a loop; None where there is none left.

        Raises:
            DeviceError: the device failed, or went away and did not come back.
            SlopeError: the pictures do not fit the calibration.
        """
        ahead = self._ahead
        if ahead is None:
            return None
        asked_s = time.perf_counter()
        given = ahead.next()
        if given is None:
            return None
        self.waited_s += max(0.0, given.taken.handed_over_s - asked_s)
        if self._is_stored:  # each of them is used, however old it gets
            ahead.begin()
        return given

    def rectify_next(self) -> None:
        """Begin to rectify the next one of a loop, if there is a loop."""
        if self._ahead is not None:
            self._ahead.begin()

    def grabbed(self, timeout_s: float) -> Taken:
        """Return a multi-view that is exposed after the call; of stored ones the next.

        Raises:
            DeviceError: see `Camera.grab`.
        """
        ahead = self._ahead
        if self._is_stored:  # what was read ahead comes first
            found = ahead.next_taken() if ahead else (self._left.popleft() if self._left else None)
            return found or self._stamped(self._device.grab(timeout_s))
        if ahead is None:
            return self._stamped(self._device.grab(timeout_s))
        with ahead.paused(timeout_s) as is_free:
            if not is_free:
                raise CaptureTimeoutError(
                    f"rig {self._run.profile.name}",
                    missing=self._device.views,
                    timeout_s=timeout_s,
                )
            return self._stamped(self._device.grab(timeout_s))

    def wake(self) -> None:
        """Let whoever waits for a multi-view have none; from any thread, for good."""
        self._is_over = True
        if self._ahead is not None:
            self._ahead.wake()

    def stop(self) -> None:
        """End the threads; what was read ahead of stored pictures is kept for the next loop."""
        ahead = self._ahead
        if ahead is None:
            return
        left = ahead.stop()
        if self._ahead is ahead:
            self._ahead = None
            self._left = deque(left if self._is_stored else ())

    def _taking_ahead(self) -> Ahead:
        stream, count = self._reopening.stream(), self._leave_out
        rules = Rules(self._stamped, self._run.profile.camera.max_skew_s, count)
        if not isinstance(self._clock, SystemClock):
            taking = TakingOnDemand(stream, rules)
        elif self._is_stored:
            taking = TakingThread(stream, rules, room=_READ_AHEAD, waits=True, before=self._left)
        else:
            taking = TakingThread(stream, rules, room=1, waits=False)
        return Ahead(taking, lambda taken: rectified(self._run, taken), count)

    def _stamped(self, views: MultiView) -> Taken:
        age_s = self._clock.now_s() - views.timestamp_s
        return Taken(views, age_s, self._utc_ns() - round(1e9 * age_s), time.perf_counter())

    def _leave_out(self, reason: str) -> None:
        self._left_out[reason] += 1

    def _is_left_alone(self) -> bool:
        return self._is_over or (self._ahead is not None and self._ahead.is_over)
