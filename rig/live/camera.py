"""A rig as a depth camera: what `rig.open` gives."""

import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from rig.devices import Camera, Clock, SystemClock
from rig.errors import CameraUseError, ViewSkewError
from rig.frames import MultiView
from rig.live.again import Reopening
from rig.live.frame import DepthFrame
from rig.live.measure import DepthMeter
from rig.stored import Run

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
    be called from anywhere. It starts no thread, prints nothing and leaves signals alone.

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
        self._closing = threading.Event()
        self._was_opened = False
        self._opened: _Opened | None = None
        self._stack = ExitStack()
        self._skewed = 0
        self._dropped: Mapping[str, int] = {}

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
                is_over=self._closing.is_set,
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
        return {**counts, "skew": counts.get("skew", 0) + self._skewed}

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
            multiview = opened.device.grab(wait_s)
            if multiview.skew_s > config.max_skew_s:
                raise ViewSkewError(
                    self._name, skew_s=multiview.skew_s, allowed_s=config.max_skew_s
                )
            return self._measured(opened, multiview, follows=False)

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
        try:
            with closing(opened.reopening.stream()) as stream:
                while not self._closing.is_set():
                    with self._used():
                        frame, is_last = self._next(opened, stream)
                    if is_last:
                        return
                    if frame is not None:
                        yield frame
        finally:
            self._looping = None

    def _next(self, opened: _Opened, stream: Iterator[MultiView]) -> tuple[DepthFrame | None, bool]:
        """Return the next frame, None for one that is skewed; and whether there is none left."""
        try:
            multiview = next(stream, None)
        except Exception:
            if self._closing.is_set():  # nobody waits for it any more
                return None, True
            raise
        if multiview is None:
            return None, True
        if multiview.skew_s > self.run.profile.camera.max_skew_s:
            self._skewed += 1
            return None, False
        return self._measured(opened, multiview, follows=True), False

    def _measured(self, opened: _Opened, multiview: MultiView, *, follows: bool) -> DepthFrame:
        age_s = opened.clock.now_s() - multiview.timestamp_s
        time_ns = self._utc_ns() - round(1e9 * age_s)
        return opened.meter.measure(multiview, time_ns, follows=follows)

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
