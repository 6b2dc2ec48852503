"""A camera for sweeps in which only the stage matters."""

from collections.abc import Callable, Iterator, Mapping
from typing import Self

import numpy as np

from rig.devices import Clock
from rig.frames import Frame, MultiView


class Witness:
    """A camera that notes where the board truly is; keeps `rig.devices.Camera`."""

    views = ("centre",)
    identity: Mapping[str, str] = {"kind": "witness"}
    dropped: Mapping[str, int] = {}

    def __init__(self, clock: Clock, true_mm: Callable[[], float]) -> None:
        self._clock = clock
        self._true_mm = true_mm
        self.seen_mm: list[float] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to give back."""

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        self.seen_mm.append(self._true_mm())
        image = np.zeros((1, 1), np.uint8)
        now_s = self._clock.now_s()
        return MultiView((Frame("centre", image, timestamp_s=now_s, sequence=len(self.seen_mm)),))

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        while True:
            yield self.grab(1.0)
