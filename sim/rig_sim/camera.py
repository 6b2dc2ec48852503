"""The simulated camera: looks at the World, keeps `rig.devices.Camera`."""

import math
from collections.abc import Iterator, Mapping
from typing import Self

from rig.devices import not_open
from rig.errors import CaptureTimeoutError
from rig.frames import Frame, MultiView
from rig.profile import SimCameraConfig
from rig_sim.lenslets.exposures import RawExposures
from rig_sim.pictures import Exposures
from rig_sim.world import World

_NAME = "camera sim"


class SimCamera:
    """Runs freely at its frame interval from the moment it is opened; waits on the World's clock.

    A frame sees the board where it is in the middle of the exposure; there is no motion blur.
    Frames are numbered as they are taken out: a gap in the numbers of a stream means dropped ones.

    Args:
        config: size and timing.
        world: what it looks at.
        raw: exposures of its one raw view, where it stands behind a lenslet array.
    """

    def __init__(
        self, config: SimCameraConfig, world: World, raw: RawExposures | None = None
    ) -> None:
        self._config = config
        self._world = world
        self._exposures = Exposures(world, in_colour=config.colour) if raw is None else raw
        self._views = world.views if raw is None else raw.views
        self._opened_s: float | None = None
        self._sequence = 0
        self._late = 0

    def __enter__(self) -> Self:
        self._opened_s = self._world.clock.now_s()
        self._sequence = 0
        self._late = 0
        return self

    def __exit__(self, *_: object) -> None:
        self._opened_s = None

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {
            "kind": "sim",
            "model": f"simulated array of {len(self.views)} views",
            "serial": self._world.profile.name,
            "renderer": self._exposures.renderer,
        }

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._views

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`; `late`: overwritten by a newer frame before they were asked for."""
        return {"late": self._late}

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        opened_s = self._since()
        called_s = self._world.clock.now_s()
        slot = math.ceil((called_s - opened_s) / self._config.frame_interval_s)
        if self._start_s(slot) < called_s:  # rounding of the division
            slot += 1
        return self._take(slot, deadline_s=called_s + timeout_s)

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        clock, config = self._world.clock, self._config
        slot = math.ceil((clock.now_s() - self._since()) / config.frame_interval_s)
        while True:
            ready_s = clock.now_s() - self._since() - config.exposure_s
            newest = math.floor(ready_s / config.frame_interval_s)
            if newest > slot:
                self._late += newest - slot
                self._sequence += newest - slot
                slot = newest
            yield self._take(slot, deadline_s=clock.now_s() + config.timeout_s)
            slot += 1

    def _take(self, slot: int, *, deadline_s: float) -> MultiView:
        clock, exposure_s = self._world.clock, self._config.exposure_s
        called_s, start_s = clock.now_s(), self._start_s(slot)
        if start_s + exposure_s > deadline_s:
            clock.sleep_s(deadline_s - called_s)
            raise CaptureTimeoutError(_NAME, missing=self.views, timeout_s=deadline_s - called_s)
        clock.sleep_s(start_s + exposure_s - called_s)
        middle_s = start_s + exposure_s / 2.0
        seed = self._world.config.seed
        frames = tuple(
            Frame(
                view=name,
                image=exposure.grey.draw((seed, number, self._sequence)),
                timestamp_s=middle_s,
                sequence=self._sequence,
                exposure_s=exposure_s,
                colour=exposure.colour((seed, number, self._sequence)),
            )
            for number, (name, exposure) in enumerate(
                zip(self.views, self._exposures.at(middle_s), strict=True)
            )
        )
        self._sequence += 1
        return MultiView(frames, self._world.temperature_degc(middle_s))

    def _start_s(self, slot: int) -> float:
        return self._since() + slot * self._config.frame_interval_s

    def _since(self) -> float:
        if self._opened_s is None:
            raise not_open(_NAME)
        return self._opened_s
