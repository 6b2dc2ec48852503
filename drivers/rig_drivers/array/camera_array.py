"""Several cameras of any kind as one: opened together, paired by time."""

import threading
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Self

from rig.devices import Camera, not_open
from rig.errors import (
    CaptureTimeoutError,
    ConfigError,
    DeviceError,
    ViewSkewError,
)
from rig.frames import Frame, MultiView
from rig_drivers.array.frame_takers import FrameTakers
from rig_drivers.array.pairing import Pairing
from rig_drivers.together import close_together, open_together, start_together

_NAME: Final = "camera array"
_READY: Final = 2
"""Multi-views that wait for the reader; a further one takes the place of the oldest."""
_LEAD_IN: Final = "lead-in"


@dataclass(slots=True)
class _Grab:
    """A call that waits for frames exposed after it."""

    called_s: float
    pairing: Pairing[MultiView]
    multiview: MultiView | None = None


class CameraArray:
    """N cameras, each with its own views, as one camera; keeps `Camera`.

    One thread per camera takes its frames as they come, so that no driver is ever blocked. What
    belongs together is decided by `rig_drivers.array.pairing.Pairing` on the time of the host.
    All cameras must count time on CLOCK_MONOTONIC, and in real time.

    In `dropped` are the frames that the cameras dropped themselves, those that found no partner
    (`unpaired`, `skew`, `order`), and multi-views that were not read in time (`late`).

    Args:
        cameras: closed; they are opened and closed with the array.
        views: all views of all cameras, in the order of every multi-view.
        period_s: time from frame to frame that was asked of the cameras.
        max_skew_s: largest time between the views of a multi-view; in a stream at most a quarter of
            the period counts.
        timeout_s: longest wait for one multi-view of the stream.

    Raises:
        ConfigError: the views of the cameras are not `views`.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        *,
        views: Sequence[str],
        period_s: float,
        max_skew_s: float,
        timeout_s: float,
    ) -> None:
        given = [view for camera in cameras for view in camera.views]
        if sorted(given) != sorted(views):
            raise ConfigError(
                f"asked for the views {', '.join(views)}, found {', '.join(given)}",
                advice="give each view of the profile one camera",
            )
        self._cameras = tuple(cameras)
        self._views = tuple(views)
        self._period_s = period_s
        self._max_skew_s = max_skew_s
        self._timeout_s = timeout_s
        self._news = threading.Condition()
        self._takers = FrameTakers(
            self._cameras, name=_NAME, take=self._pair, ended=self._end, failed=self._fail
        )
        self._reset()

    def __enter__(self) -> Self:
        """Open all cameras at the same time, start them together, and take their frames.

        Free-running cameras keep the phases that they start with: the closer, the better.

        Raises:
            DeviceError, ConfigError: one camera did not open; the others were closed again.
            DeviceNotFoundError: several did not; the message tells of each.
        """
        self._reset()
        open_together(self._cameras, name=_NAME)
        try:
            start_together(self._cameras)
        except BaseException:
            close_together(self._cameras)
            raise
        self._is_open = True
        self._takers.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Close all; a camera that is silent delays this by at most its own timeout."""
        with self._news:
            self._is_open = False
            self._news.notify_all()
        self._takers.stop()
        close_together(self._cameras)

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`; what each camera says is under the names of its views."""
        parts = [camera.identity for camera in self._cameras]
        kinds = Counter(part["kind"] for part in parts)
        whole = {
            "kind": "array",
            "model": " + ".join(f"{count} x {kind}" for kind, count in kinds.items()),
            "serial": ", ".join(part["serial"] for part in parts),
        }
        for camera, part in zip(self._cameras, parts, strict=True):
            whole |= {f"{'+'.join(camera.views)}.{key}": value for key, value in part.items()}
        return whole

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._views

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`."""
        with self._news:
            total = Counter({"late": self._late})
            for (_, reason), count in self._pairing.dropped.items():
                if reason != _LEAD_IN:  # from before the array as a whole ran
                    total[reason] += count
        for camera in self._cameras:
            total.update(camera.dropped)
        return {reason: count for reason, count in total.items() if count}

    def dropped_by_view(self) -> dict[str, dict[str, int]]:
        """Return frames that found no partner, by the names of a camera's views and by reason."""
        with self._news:
            counts = dict(self._pairing.dropped)
        found: dict[str, dict[str, int]] = {}
        for (index, reason), count in counts.items():
            found.setdefault("+".join(self._cameras[index].views), {})[reason] = count
        return found

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`.

        All views are exposed after the call and within `max_skew_s` of each other. While a sweep
        grabs nothing moves, so that cameras with any phase may be used: the limit of a quarter
        period holds for `stream` only.
        """
        called_s = time.monotonic()
        with self._news:
            self._grab = _Grab(called_s, self._new_pairing(is_static=True))
            try:
                while self._grab.multiview is None:
                    self._require_running()
                    left_s = called_s + timeout_s - time.monotonic()
                    if left_s <= 0.0:
                        raise self._nothing_since(called_s, timeout_s, self._grab.pairing)
                    self._news.wait(left_s)
                return self._grab.multiview
            finally:
                self._grab = None

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        called_s = time.monotonic()
        with self._news:
            self._require_running()
            self._ready.clear()
            self._is_streaming = True
        try:
            while True:
                multiview = self._next(called_s)
                if multiview is None:
                    return
                yield multiview
        finally:
            with self._news:
                self._is_streaming = False

    def _next(self, called_s: float) -> MultiView | None:
        """Return the oldest multi-view that waits; None after the last of stored cameras."""
        asked_s = time.monotonic()
        with self._news:
            while True:
                self._require_running()
                while self._ready:
                    multiview = self._ready.popleft()
                    if multiview.timestamp_s >= called_s:
                        return multiview
                if self._ended:
                    return None
                left_s = asked_s + self._timeout_s - time.monotonic()
                if left_s <= 0.0:
                    raise self._nothing_since(asked_s, self._timeout_s, self._pairing)
                self._news.wait(left_s)

    def _end(self) -> None:
        with self._news:
            self._ended = True
            self._news.notify_all()

    def _fail(self, error: BaseException) -> None:
        with self._news:
            self._failure = self._failure or error
            self._news.notify_all()

    def _pair(self, index: int, multiview: MultiView) -> None:
        with self._news:
            self._newest_s[index] = _began_s(multiview)
            if self._grab is not None and self._newest_s[index] >= self._grab.called_s:
                self._answer(self._grab, index, multiview)
            outcome = self._pairing.push(index, multiview.timestamp_s, multiview)
            for group in outcome.groups:
                if len(self._ready) == _READY:
                    self._ready.popleft()
                    self._late += self._is_streaming
                self._ready.append(self._composed(group))
            if outcome.groups:
                self._news.notify_all()

    def _answer(self, grab: "_Grab", index: int, multiview: MultiView) -> None:
        outcome = grab.pairing.push(index, multiview.timestamp_s, multiview)
        if outcome.groups and grab.multiview is None:
            grab.multiview = self._composed(outcome.groups[0])
            self._news.notify_all()

    def _composed(self, group: Sequence[MultiView]) -> MultiView:
        by_view: dict[str, Frame] = {f.view: f for part in group for f in part.frames}
        warmth = [p.temperature_degc for p in group if p.temperature_degc is not None]
        return MultiView(
            tuple(by_view[view] for view in self._views), max(warmth) if warmth else None
        )

    def _require_running(self) -> None:
        if not self._is_open:
            raise not_open(_NAME)
        if self._failure is not None:
            raise self._failure

    def _nothing_since(
        self, since_s: float, timeout_s: float, pairing: Pairing[MultiView]
    ) -> DeviceError:
        """Return the error that tells whether frames were missing or only did not match."""
        missing = tuple(
            view
            for camera, newest_s in zip(self._cameras, self._newest_s, strict=True)
            if newest_s < since_s
            for view in camera.views
        )
        skew_s = pairing.last_rejected_s
        if missing or skew_s is None:
            return CaptureTimeoutError(_NAME, missing=missing or self._views, timeout_s=timeout_s)
        return ViewSkewError(_NAME, skew_s=skew_s, allowed_s=pairing.limit_s)

    def _reset(self) -> None:
        self._is_open = False
        self._is_streaming = False
        self._ended = False
        self._failure: BaseException | None = None
        self._late = 0
        self._ready: deque[MultiView] = deque()
        self._newest_s = [float("-inf")] * len(self._cameras)
        self._grab: _Grab | None = None
        self._pairing = self._new_pairing(is_static=False)

    def _new_pairing(self, *, is_static: bool) -> Pairing[MultiView]:
        return Pairing(
            len(self._cameras),
            period_s=self._period_s,
            max_skew_s=self._max_skew_s,
            is_static=is_static,
        )


def _began_s(multiview: MultiView) -> float:
    return min(frame.began_s for frame in multiview.frames)
