"""The camera: keeps `rig.devices.Camera`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Self

import numpy as np

from rig.devices import Clock, not_open
from rig.errors import CaptureTimeoutError
from rig.frames import Frame, GreyImage, MultiView
from rig.profile import ViewConfig
from rig_example_devices.kind import PatternCameraConfig

_NAME = "camera pattern"


class PatternCamera:
    """Draws a multi-view whenever it is asked; it never waits in a queue, and so is never old."""

    dropped: Mapping[str, int] = {}

    def __init__(
        self, config: PatternCameraConfig, views: Sequence[ViewConfig], clock: Clock
    ) -> None:
        self._config, self._places, self._clock = config, tuple(views), clock
        self.views = tuple(view.name for view in views)
        self._next: int | None = None

    def __enter__(self) -> Self:
        self._next = 0
        return self

    def __exit__(self, *_: object) -> None:
        self._next = None

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": "pattern", "model": "drawn dots", "serial": "pattern-1"}

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        if self._next is None:
            raise not_open(_NAME)
        exposure_s = self._config.exposure_s
        if exposure_s > timeout_s:
            self._clock.sleep_s(timeout_s)
            raise CaptureTimeoutError(_NAME, missing=self.views, timeout_s=timeout_s)
        began_s = self._clock.now_s()
        self._clock.sleep_s(exposure_s)
        frames = tuple(
            Frame(
                view.name,
                self._drawn(view.x_steps, view.y_steps),
                timestamp_s=began_s + exposure_s / 2.0,
                sequence=self._next,
                exposure_s=exposure_s,
            )
            for view in self._places
        )
        self._next += 1
        return MultiView(frames)

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        while True:
            yield self.grab(self._config.timeout_s)

    def _drawn(self, x_steps: float, y_steps: float) -> GreyImage:
        config = self._config
        wall = np.random.default_rng(1).integers(0, 256, (config.height_px, config.width_px))
        shift = (-round(config.slope_px * y_steps), -round(config.slope_px * x_steps))
        return np.roll(wall, shift, (0, 1)).astype(np.uint8)
