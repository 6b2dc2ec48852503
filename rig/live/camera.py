"""A rig as a depth camera: what `rig.open` gives."""

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from rig.devices import Camera, Clock, SystemClock
from rig.errors import CameraUseError, CaptureTimeoutError, ViewSkewError
from rig.frames import MultiView
from rig.live.again import Reopening
from rig.live.ahead import Ahead
from rig.live.frame import DepthFrame
from rig.live.measure import DepthMeter, Rectified, rectified
from rig.live.taking import Rules, Taken, Taking, TakingOnDemand, TakingThread
from rig.stored import Run

_READ_AHEAD = 2
"""Stored multi-views that wait to be rectified."""
_WITH = 'use "with rig.open(...) as camera:"'


@dataclass(frozen=True, slots=True)
class _Opened:
    """What there is while a camera is open."""

    device: Camera
    clock: Clock
    reopening: Reopening
    meter: DepthMeter


class DepthCamera:
    """Gives depth: a context manager to loop over.

    One thread uses it at a time, and while one loops no other may; only `close` and `dropped` may
    be called from anywhere. While one loops, two threads take and rectify what comes next; they end
    with the loop. It prints nothing and leaves signals alone.

    Args:
        run: what the rig uses.
        door: opens the device; gives it and the clock of its times.
        utc_ns: this machine's wall clock.
    """

    def __init__(
        self,
        run: Run,
        door: Callable[[], AbstractContextManager[tuple[Camera, Clock]]],
        *,
        utc_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        self.run = run
        """Profile, optics and curve that are used."""
        self._door = door
        self._utc_ns = utc_ns
        self._name = f"rig {run.profile.name}"
        self._using = threading.Lock()
        self._user: int | None = None
        self._looping: int | None = None
        self._loops = 0
        self._ahead: Ahead | None = None
        self._left: deque[Taken] = deque()
        self._closing = threading.Event()
        self._was_opened = False
        self._opened: _Opened | None = None
        self._stack = ExitStack()
        self._left_out: Counter[str] = Counter()
        self._dropped: Mapping[str, int] = {}
        self.waited_s = 0.0
        """How long loops have waited for the camera: for pictures, or for the simulation of them.
        """

    def __enter__(self) -> Self:
        """Open the device.

        Raises:
            CameraUseError: it is or was open.
            DeviceError: the device is not there or does not answer.
        """
        with self._used():
            if self._was_opened or self._closing.is_set():
                state = "was closed" if self._closing.is_set() else "is open already"
                raise CameraUseError(
                    self._name, f"asked to open it, but it {state}", advice="call rig.open again"
                )
            device, clock = self._stack.enter_context(self._door())
            self._was_opened = True
            reopening = Reopening(
                device,
                clock,
                reconnect_s=self._reconnect_s,
                is_over=self._is_over,
            )
            self._opened = _Opened(device, clock, reopening, DepthMeter(self.run))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the device; from any thread, any number of times.

        A loop in another thread ends without an error after the frame that it is busy with; this
        call waits for that, at most `camera.timeout_s` of the profile and the time of one frame.
        """
        self._closing.set()
        if self._ahead is not None:
            self._ahead.wake()
        if self._user == threading.get_ident():
            return  # called by a signal in the middle of a frame: its end closes
        with self._using:
            self._shut()

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the views in the order of `DepthFrame.views`."""
        return tuple(view.name for view in self.run.profile.views)

    @property
    def identity(self) -> Mapping[str, str]:
        """What tells this device from another one: kind, model, serial number, firmware.

        Raises:
            CameraUseError: it is not open.
        """
        return self._running().device.identity

    @property
    def can_wait(self) -> bool:
        """Whether nothing is lost while nobody asks: pictures are stored, or time is simulated.

        Raises:
            CameraUseError: it is not open.
        """
        is_real = isinstance(self._running().clock, SystemClock)
        return self.run.profile.camera.is_stored or not is_real

    @property
    def dropped(self) -> Mapping[str, int]:
        """How many multi-views were dropped since opening, by reason; kept after closing."""
        opened = self._opened
        counts = self._dropped if opened is None else opened.reopening.dropped
        total = Counter({"skew": 0})
        for part in (counts, self._left_out):
            total.update(part)
        return dict(total)

    def grab(self, timeout_s: float | None = None) -> DepthFrame:
        """Return a frame that is exposed after the call; all of the range is searched.

        A stored camera gives its next multi-view.

        Args:
            timeout_s: longest wait for the pictures; None takes `camera.timeout_s` of the profile.

        Raises:
            CameraUseError: outside of `with`, or another thread uses the camera.
            CaptureTimeoutError: not all views arrived in time.
            ViewSkewError: the views were exposed too far apart in time.
            DeviceLostError: the device is gone; it is not looked for.
            CurveError: rows miss otherwise than when the curve was made.
            SlopeError: the images give no slopes at all.
        """
        config = self.run.profile.camera
        with self._used():
            opened = self._running()
            self._refuse_another_loop()
            wait_s = config.timeout_s if timeout_s is None else timeout_s
            taken = self._grabbed(opened, wait_s)
            if taken.views.skew_s > config.max_skew_s:
                raise ViewSkewError(
                    self._name, skew_s=taken.views.skew_s, allowed_s=config.max_skew_s
                )
            return opened.meter.measure(rectified(self.run, taken), follows=False)

    def __iter__(self) -> Generator[DepthFrame]:
        """Yield depth, each frame the hypothesis for the next, until the camera is closed.

        Live: the newest multi-view each time; what came while the last one was used is dropped and
        counted, and the driver is never blocked. Stored: every multi-view, once; then the loop
        ends. Multi-views whose views are too far apart in time are left out and counted.

        A device that goes away is looked for as long as `camera.reconnect_s` of the profile says.

        Raises:
            CameraUseError: outside of `with`, or another thread uses the camera.
            DeviceError: the device failed, or went away and did not come back.
            CurveError: rows miss otherwise than when the curve was made.
            SlopeError: the images give no slopes at all, or the reference view is frozen.
        """
        self._running()
        self._refuse_another_loop()
        return self._loop()

    def _loop(self) -> Generator[DepthFrame]:
        with self._used():
            opened = self._running()
            self._refuse_another_loop()
            self._looping = threading.get_ident()
            self._loops += 1
            ahead = self._ahead = self._ahead or self._taking_ahead(opened)
        try:
            while not self._closing.is_set():
                with self._used():
                    frame = self._next(opened, ahead)
                if frame is None:
                    return
                yield frame
        finally:
            self._loops -= 1
            if not self._loops:
                self._looping = None
                self._stop_taking()

    def _next(self, opened: _Opened, ahead: Ahead) -> DepthFrame | None:
        asked_s = time.perf_counter()
        given = ahead.next()
        if given is None:
            return None
        self.waited_s += max(0.0, given.taken.handed_over_s - asked_s)
        if self.run.profile.camera.is_stored:  # each of them is used, however old it gets
            ahead.begin()
        return opened.meter.measure(given, follows=True, on_slopes=ahead.begin)

    def _taking_ahead(self, opened: _Opened) -> Ahead:
        config, count = self.run.profile.camera, self._leave_out
        stream = opened.reopening.stream()
        rules = Rules(lambda views: self._stamped(opened, views), config.max_skew_s, count)
        taking: Taking
        if not isinstance(opened.clock, SystemClock):
            taking = TakingOnDemand(stream, rules)
        elif config.is_stored:
            taking = TakingThread(stream, rules, room=_READ_AHEAD, waits=True, before=self._left)
        else:
            taking = TakingThread(stream, rules, room=1, waits=False)
        return Ahead(taking, self._rectified, count)

    def _stop_taking(self) -> None:
        ahead = self._ahead
        if ahead is None:
            return
        left = ahead.stop()
        if self._ahead is ahead:
            self._ahead = None
            self._left = deque(left if self.run.profile.camera.is_stored else ())

    def _grabbed(self, opened: _Opened, timeout_s: float) -> Taken:
        ahead = self._ahead
        if self.run.profile.camera.is_stored:  # what was read ahead comes first
            found = ahead.next_taken() if ahead else (self._left.popleft() if self._left else None)
            return found or self._stamped(opened, opened.device.grab(timeout_s))
        if ahead is None:
            return self._stamped(opened, opened.device.grab(timeout_s))
        with ahead.paused(timeout_s) as is_free:
            if not is_free:
                raise CaptureTimeoutError(self._name, missing=self.views, timeout_s=timeout_s)
            return self._stamped(opened, opened.device.grab(timeout_s))

    def _stamped(self, opened: _Opened, views: MultiView) -> Taken:
        age_s = opened.clock.now_s() - views.timestamp_s
        return Taken(views, age_s, self._utc_ns() - round(1e9 * age_s), time.perf_counter())

    def _rectified(self, taken: Taken) -> Rectified:
        return rectified(self.run, taken)

    def _leave_out(self, reason: str) -> None:
        self._left_out[reason] += 1

    def _is_over(self) -> bool:
        """Whether nobody waits for the stream any more."""
        return self._closing.is_set() or (self._ahead is not None and self._ahead.is_over)

    @contextmanager
    def _used(self) -> Generator[None]:
        """Refuse a second thread; close in the end what was to be closed meanwhile."""
        if not self._using.acquire(blocking=False):
            raise self._busy()
        try:
            self._user = threading.get_ident()
            yield
        finally:
            self._user = None
            if self._closing.is_set():
                self._shut()
            self._using.release()

    def _shut(self) -> None:
        self._stop_taking()
        if self._opened is not None:
            self._dropped = dict(self._opened.reopening.dropped)
        self._opened = None
        self._stack.close()

    def _running(self) -> _Opened:
        if self._opened is None:
            raise CameraUseError(
                self._name,
                f"asked for frames, but it {'was closed' if self._was_opened else 'is not open'}",
                advice=_WITH,
            )
        return self._opened

    def _refuse_another_loop(self) -> None:
        if self._looping not in (None, threading.get_ident()):
            raise self._busy()

    def _busy(self) -> CameraUseError:
        return CameraUseError(
            self._name,
            "asked for frames while another thread uses it",
            advice="let one thread loop and hand its frames to the others",
        )

    @property
    def _reconnect_s(self) -> float:
        """What is stored does not go away: begun anew it would give its first pictures again."""
        config = self.run.profile.camera
        return 0.0 if config.is_stored else config.reconnect_s
