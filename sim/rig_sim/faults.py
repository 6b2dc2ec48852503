"""Cameras with one fault each: a wrapper around any camera, and the fault as a value."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Self

from rig.devices import Camera, Clock
from rig.errors import CaptureTimeoutError, DeviceLostError, ViewSkewError
from rig.frames import MultiView

_NAME = "camera sim"


@dataclass(frozen=True, slots=True)
class LostViews:
    """From one multi-view on, nothing comes from some views any more."""

    names: tuple[str, ...]
    after: int = 0
    """How many multi-views are good."""


@dataclass(frozen=True, slots=True)
class LateViews:
    """From one multi-view on, some views are exposed later than the others."""

    names: tuple[str, ...]
    late_s: float
    after: int = 0
    """How many multi-views are good."""


@dataclass(frozen=True, slots=True)
class StuckCamera:
    """From one multi-view on, the last good one comes again and again, old timestamps and all."""

    after: int = 1
    """How many multi-views are good, at least one."""


@dataclass(frozen=True, slots=True)
class UnpluggedCamera:
    """From one multi-view on, the camera is gone until it is opened again."""

    after: int = 0
    """How many multi-views are good."""


CameraFault = LostViews | LateViews | StuckCamera | UnpluggedCamera


class FaultyCamera:
    """A camera with a fault; keeps `rig.devices.Camera`.

    Args:
        camera: the camera that would be good.
        fault: what is wrong with it; the count of good multi-views begins anew at each opening.
        clock: where waiting for what never comes takes place.
        max_skew_s: largest skew that the camera lets pass.
        timeout_s: longest wait for one multi-view of the stream.
    """

    def __init__(
        self,
        camera: Camera,
        fault: CameraFault,
        *,
        clock: Clock,
        max_skew_s: float,
        timeout_s: float,
    ) -> None:
        self._camera = camera
        self._fault = fault
        self._clock = clock
        self._max_skew_s = max_skew_s
        self._timeout_s = timeout_s
        self._taken = 0
        self._last: MultiView | None = None
        self._skewed = 0

    def __enter__(self) -> Self:
        self._camera.__enter__()
        self._taken = 0
        self._last = None
        self._skewed = 0
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._camera.__exit__(kind, error, trace)

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return self._camera.identity

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._camera.views

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`; `skew`: views of one multi-view too far apart in time."""
        return {**self._camera.dropped, "skew": self._skewed}

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        called_s = self._clock.now_s()
        multiview = self._camera.grab(timeout_s)
        self._taken += 1
        if self._taken <= self._fault.after:
            self._last = multiview
            return multiview
        match self._fault:
            case LostViews(names):
                self._clock.sleep_s(called_s + timeout_s - self._clock.now_s())
                raise CaptureTimeoutError(_NAME, missing=names, timeout_s=timeout_s)
            case LateViews(names, late_s):
                return self._in_step(_delayed(multiview, names, late_s))
            case StuckCamera():
                return multiview if self._last is None else self._last
            case UnpluggedCamera():
                raise DeviceLostError(
                    _NAME, "stopped answering", advice="check cable and power, open again"
                )

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`; multi-views out of step are dropped and counted."""
        good_s = self._clock.now_s()
        while True:
            try:
                yield self.grab(self._timeout_s)
                good_s = self._clock.now_s()
            except ViewSkewError:
                self._skewed += 1
                if self._clock.now_s() - good_s > self._timeout_s:
                    raise CaptureTimeoutError(
                        _NAME, missing=self.views, timeout_s=self._timeout_s
                    ) from None

    def _in_step(self, multiview: MultiView) -> MultiView:
        if multiview.skew_s > self._max_skew_s:
            raise ViewSkewError(_NAME, skew_s=multiview.skew_s, allowed_s=self._max_skew_s)
        return multiview


def _delayed(multiview: MultiView, names: tuple[str, ...], late_s: float) -> MultiView:
    return replace(
        multiview,
        frames=tuple(
            replace(frame, timestamp_s=frame.timestamp_s + late_s) if frame.view in names else frame
            for frame in multiview.frames
        ),
    )
