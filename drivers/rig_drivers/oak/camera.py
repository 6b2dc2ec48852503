"""OAK cameras behind `rig.devices.Camera`."""

import statistics
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from typing import Self

from rig.devices import Clock, not_open
from rig.errors import (
    CaptureTimeoutError,
    ControlError,
    DeviceLostError,
    DeviceNotFoundError,
    ViewSkewError,
)
from rig.factory import FactoryCamera
from rig.frames import Frame, MultiView
from rig.profile import OakCameraConfig
from rig_drivers.oak.arrivals import Arrivals, Seen
from rig_drivers.oak.bandwidth import needed_mb_s
from rig_drivers.oak.controls import Controls
from rig_drivers.oak.decode import Decoded, decode, start_s
from rig_drivers.oak.sensors import Sensors
from rig_drivers.oak.streams import Group, Streams

_SLICE_S = 0.05
"""Longest wait inside the library, so that Ctrl-C and a dead link are noticed."""
_OPENING_TIMEOUTS = 2.0
"""How many times `camera.timeout_s` the first good multi-view may take."""
_RECONNECT_PAUSE_S = 0.5


class OakCamera:
    """All sensors of one device as one camera; keeps `rig.devices.Camera`.

    Opening ends with a multi-view whose frames report the controls that were asked for; every later
    frame is compared again. Multi-views are numbered as they are taken out: a gap in the numbers of
    a stream means dropped ones.

    Args:
        config: the profile's camera.
        views: names, in the order of the frames.
        sensors: a device's, or others; opened and closed here.
        clock: CLOCK_MONOTONIC, which is also the clock of the frames.
    """

    def __init__(
        self, config: OakCameraConfig, views: Sequence[str], sensors: Sensors, clock: Clock
    ) -> None:
        self._config = config
        self._views = tuple(views)
        self._sensors = sensors
        self._clock = clock
        self._controls = {view: Controls.of(config.of(view)) for view in self._views}
        self._stack = ExitStack()
        self._arrivals: Arrivals | None = None
        self._streams: Streams | None = None
        self._next_number = 0
        self._dropped: dict[str, int] = {}

    def __enter__(self) -> Self:
        self._next_number = 0
        self._dropped = {"late": 0, "unpaired": 0, "skew": 0, "reconnect": 0}
        self._open()
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return self._sensors.identity

    @property
    def factory_calibration(self) -> Sequence[FactoryCamera] | None:
        """See `rig.factory.FactoryCalibrated`."""
        return self._sensors.factory_calibration

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._views

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`.

        `late`: overwritten by a newer one; `unpaired`: a sensor's frame was lost; `skew`: views too
        far apart; `reconnect`: times the device was lost and found again.
        """
        return dict(self._dropped)

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        called_s = self._clock.now_s()
        group = self._next_group(begun_s=called_s, since_s=called_s, timeout_s=timeout_s)
        multiview = self._multiview(group)
        if multiview.skew_s > self._config.max_skew_s:
            raise ViewSkewError(
                self._name, skew_s=multiview.skew_s, allowed_s=self._config.max_skew_s
            )
        self._next_number += 1
        return multiview

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`; a lost device is looked for `camera.reconnects` times."""
        self._running()
        while True:
            try:
                yield from self._stream_until_lost()
            except DeviceLostError as error:
                if self._streams is None:  # closed by whoever used the stream
                    raise
                self._reopen(error)

    def _stream_until_lost(self) -> Iterator[MultiView]:
        before: Group | None = None
        while True:
            good_s = self._clock.now_s()
            while True:
                group = self._next_group(
                    begun_s=good_s if before is None else 0.0,
                    since_s=good_s,
                    timeout_s=self._config.timeout_s,
                )
                self._count_lost(before, group)
                before = group
                multiview = self._multiview(group)
                self._next_number += 1
                if multiview.skew_s <= self._config.max_skew_s:
                    break
                self._dropped["skew"] += 1
            yield multiview

    def _next_group(self, *, begun_s: float, since_s: float, timeout_s: float) -> Group:
        """Wait for frames of all views that belong together.

        Args:
            begun_s: groups with an exposure that began earlier are passed over.
            since_s: from when on `timeout_s` counts; a view without a frame since then is missing.
            timeout_s: longest wait.
        """
        streams = self._running()
        deadline_s = since_s + timeout_s
        while (left_s := deadline_s - self._clock.now_s()) > 0.0:
            group = streams.next_group(min(left_s, _SLICE_S))
            if group is None:
                continue
            frames = {view: frame.getSequenceNum() for view, frame in group.frames.items()}
            if self._arrivals is not None:
                self._arrivals.saw(Seen(group.number, frames))
            if all(start_s(f) >= begun_s for f in group.frames.values()):
                return group
        silent = streams.watchdog.silent_since(since_s)
        phase_s = streams.watchdog.phase_s(1.0 / self._config.rate_hz)
        if not silent and phase_s > self._config.max_skew_s:
            raise ViewSkewError(self._name, skew_s=phase_s, allowed_s=self._config.max_skew_s)
        raise CaptureTimeoutError(self._name, missing=silent or self._views, timeout_s=timeout_s)

    def _multiview(self, group: Group) -> MultiView:
        decoded = {
            view: decode(group.frames[view], f"{self._name}, view {view}") for view in self._views
        }
        for view, frame in decoded.items():
            self._controls[view].require(frame.applied, f"{self._name}, view {view}")
        frames = tuple(
            Frame(
                view,
                frame.image,
                timestamp_s=frame.timestamp_s,
                sequence=self._next_number,
                exposure_s=frame.applied.exposure_s,
                colour=frame.colour,
            )
            for view, frame in decoded.items()
        )
        return MultiView(frames, self._temperature_degc(decoded))

    def _temperature_degc(self, decoded: Mapping[str, Decoded]) -> float | None:
        told = [f.temperature_degc for f in decoded.values() if f.temperature_degc is not None]
        return statistics.fmean(told) if told else self._sensors.temperature_degc()

    def _count_lost(self, before: Group | None, group: Group) -> None:
        if before is None:
            return
        overwritten = group.number - before.number - 1
        taken = max(
            group.frames[view].getSequenceNum() - before.frames[view].getSequenceNum()
            for view in self._views
        )
        unpaired = max(0, taken - 1 - overwritten)
        self._dropped["late"] += overwritten
        self._dropped["unpaired"] += unpaired
        self._next_number += overwritten + unpaired

    def _open(self) -> None:
        with ExitStack() as stack:
            stack.enter_context(self._sensors)
            period_s = 1.0 / self._config.rate_hz
            self._arrivals = self._new_arrivals()
            self._streams = stack.enter_context(Streams(self._sensors, period_s=period_s))
            try:
                self._wait_for_controls()
            except BaseException:
                self._streams = None
                raise
            self._stack = stack.pop_all()

    def _wait_for_controls(self) -> None:
        """Let frames pass until one multi-view was exposed as asked: commands need some frames."""
        limit_s = _OPENING_TIMEOUTS * self._config.timeout_s
        begun_s = self._clock.now_s()
        refused: ControlError | None = None
        while refused is None or self._clock.now_s() < begun_s + limit_s:
            try:
                self._multiview(self._next_group(begun_s=0.0, since_s=begun_s, timeout_s=limit_s))
            except ControlError as error:
                refused = error
            except (CaptureTimeoutError, ViewSkewError):
                if refused is None:
                    raise
            else:
                return
        raise refused

    def _reopen(self, lost: DeviceLostError) -> None:
        self._close()
        for _ in range(self._config.reconnects):
            self._clock.sleep_s(_RECONNECT_PAUSE_S)
            try:
                self._open()
            except (DeviceNotFoundError, DeviceLostError, CaptureTimeoutError):
                continue
            self._dropped["reconnect"] += 1
            return
        raise lost

    def _close(self) -> None:
        self._streams = None
        self._stack.close()

    def _new_arrivals(self) -> Arrivals | None:
        """None where there is no link that could be too slow."""
        link = self._sensors.identity.get("link")
        if link is None:
            return None
        return Arrivals(
            self._name,
            link=link,
            needed_mb_s=needed_mb_s(self._config, self._views),
            rate_hz=self._config.rate_hz,
        )

    def _running(self) -> Streams:
        if self._streams is None:
            raise not_open(self._name)
        return self._streams

    @property
    def _name(self) -> str:
        return f"camera {self._sensors.name}"
