"""A rig as a depth camera: what `rig.open` gives."""

import threading
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from rig.calibration_alone import completed_run, require_same_calibration
from rig.devices import Camera, Clock
from rig.errors import CameraUseError, ViewSkewError
from rig.live.feed import Feed
from rig.live.frame import DepthFrame
from rig.live.measure import DepthMeter, Rectified, rectified
from rig.stored import Run

_WITH = 'use "with rig.open(...) as camera:"'


@dataclass(frozen=True, slots=True)
class _Opened:
    """What there is while a camera is open."""

    device: Camera
    feed: Feed
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
        """Profile, optics and curve that are used; once open, with what the device knows itself."""
        self._door = door
        self._utc_ns = utc_ns
        self._name = f"rig {run.profile.name}"
        self._using = threading.Lock()
        self._user: int | None = None
        self._looping: int | None = None
        self._closing = threading.Event()
        self._was_opened = False
        self._opened: _Opened | None = None
        self._stack = ExitStack()
        self._dropped: Mapping[str, int] = {"skew": 0}
        self._waited_s = 0.0

    def __enter__(self) -> Self:
        """Open the device.

        Raises:
            CameraUseError: it is or was open.
            ConfigError: nothing tells which slopes the distances of the profile are.
            CurveError: its curve or calibration is of another rig of the same name, or the
                device's own calibration is another one than when the curve was made.
            DeviceError: the device is not there or does not answer.
            StoreError: nothing is stored that tells depth, and the device holds no calibration.
        """
        with self._used():
            if self._was_opened or self._closing.is_set():
                state = "was closed" if self._closing.is_set() else "is open already"
                raise CameraUseError(
                    self._name, f"asked to open it, but it {state}", advice="call rig.open again"
                )
            device, clock = self._stack.enter_context(self._door())
            try:
                self.run.require_unit(device.identity)
                require_same_calibration(self.run, device.identity)
                self.run = completed_run(self.run, device)
                meter = DepthMeter(self.run)
            except BaseException:
                self._stack.close()
                raise
            self._was_opened = True
            feed = Feed(self.run, device, clock, self._utc_ns)
            self._opened = _Opened(device, feed, meter)
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
        opened = self._opened
        if opened is not None:
            opened.feed.wake()
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
        return self._running().feed.can_wait

    @property
    def dropped(self) -> Mapping[str, int]:
        """How many multi-views were dropped since opening, by reason; kept after closing."""
        opened = self._opened
        return self._dropped if opened is None else opened.feed.dropped

    @property
    def waited_s(self) -> float:
        """How long loops have waited for the camera; kept after closing."""
        opened = self._opened
        return self._waited_s if opened is None else opened.feed.waited_s

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
            taken = opened.feed.grabbed(wait_s)
            if taken.views.skew_s > config.max_skew_s:
                raise ViewSkewError(
                    self._name, skew_s=taken.views.skew_s, allowed_s=config.max_skew_s
                )
            return self._measured(opened, rectified(self.run, taken), follows=False)

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
            opened.feed.begin_loop()
        try:
            while not self._closing.is_set():
                with self._used():
                    frame = self._next(opened)
                if frame is None:
                    return
                yield frame
        finally:
            if opened.feed.end_loop():
                self._looping = None

    def _next(self, opened: _Opened) -> DepthFrame | None:
        given = opened.feed.next()
        if given is None:
            return None
        return self._measured(opened, given, follows=True)

    def _measured(self, opened: _Opened, given: Rectified, *, follows: bool) -> DepthFrame:
        begin_next = opened.feed.rectify_next
        frame = opened.meter.measure(given, follows=follows, on_slopes=begin_next)
        self.run = opened.meter.run
        return frame

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
        if self._opened is not None:
            self._opened.feed.stop()
            self._dropped = self._opened.feed.dropped
            self._waited_s = self._opened.feed.waited_s
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
