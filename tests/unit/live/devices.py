"""Opened rigs for the tests of the API: the simulated one, with its camera as it is or wrapped."""

import threading
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import Self

from rig_sim.camera import SimCamera
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.world import World

from rig.devices import Camera, Clock
from rig.frames import MultiView
from rig.live.camera import DepthCamera
from rig.profile import SimCameraConfig
from rig.testing.simulated import open_simulated_rig

TINY = ("camera.width_px=64", "camera.height_px=40", "slopes.range_px=[-2.0, 3.0]")
"""Pictures that are measured in no time; what they show does not matter."""

Wrap = Callable[[Camera, World], Camera]


def tiny_rig(
    wrap: Wrap = lambda camera, _: camera,
    *overrides: str,
    utc_ns: Callable[[], int] | None = None,
    clock: Clock | None = None,
) -> tuple[DepthCamera, World]:
    """Return a rig of tiny pictures, not yet open, and its world; time is simulated by default."""
    run = open_simulated_rig([*TINY, *overrides]).run
    config, world_config = run.profile.camera, run.profile.world
    assert isinstance(config, SimCameraConfig)
    assert world_config is not None
    clock = clock or VirtualClock()
    carriage = Carriage(world_config.carriage, clock)
    world = World(run.profile, clock=clock, carriage=carriage, scene="board")
    device = wrap(SimCamera(config, world), world)

    @contextmanager
    def open_device() -> Generator[tuple[Camera, Clock]]:
        with device:
            yield device, world.clock

    def door() -> AbstractContextManager[tuple[Camera, Clock]]:
        return open_device()

    if utc_ns is None:
        return DepthCamera(run, door), world
    return DepthCamera(run, door, utc_ns=utc_ns), world


class Gated:
    """A camera whose stream waits, from its second multi-view on, until it is let through."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self.is_waiting = threading.Event()
        self.gate = threading.Event()
        self.closed = 0

    def __enter__(self) -> Self:
        self._camera.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.closed += 1
        self._camera.__exit__(kind, error, trace)

    @property
    def identity(self) -> Mapping[str, str]:
        return self._camera.identity

    @property
    def views(self) -> tuple[str, ...]:
        return self._camera.views

    @property
    def dropped(self) -> Mapping[str, int]:
        return self._camera.dropped

    def grab(self, timeout_s: float) -> MultiView:
        return self._camera.grab(timeout_s)

    def stream(self) -> Iterator[MultiView]:
        for count, multiview in enumerate(self._camera.stream()):
            if count:
                self.is_waiting.set()
                assert self.gate.wait(60.0)
            yield multiview
