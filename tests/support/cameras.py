"""Simulated rigs for tests: a world without a stage driver, drawn in closed form."""

from dataclasses import dataclass, field

from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock
from rig_sim.scenes.catalogue import Scene
from rig_sim.world import World

from rig.profile import Profile, SimCameraConfig
from rig.profile.load import load_profile


@dataclass
class Slide:
    """A carriage that is where it was put."""

    at_mm: float = -603.0

    def travelled_mm(self, t_s: float) -> float:
        return self.at_mm


@dataclass
class SmallRig:
    """The `sim` profile with a coarse camera, or any other profile."""

    overrides: tuple[str, ...] = ()
    name: str = "sim"
    scene: Scene = "board"
    slide: Slide = field(default_factory=Slide)
    clock: VirtualClock = field(default_factory=VirtualClock)

    def __post_init__(self) -> None:
        self.profile: Profile = load_profile(
            self.name, ("world.renderer=analytic", *self.overrides)
        )
        self.world = World(self.profile, clock=self.clock, carriage=self.slide, scene=self.scene)

    @property
    def config(self) -> SimCameraConfig:
        assert isinstance(self.profile.camera, SimCameraConfig)
        return self.profile.camera

    def camera(self) -> SimCamera:
        return SimCamera(self.config, self.world)


SMALL = (
    "camera.width_px=160",
    "camera.height_px=100",
    "world.optics.focal_px=152.5",
)
"""A quarter of the resolution: quick to draw."""
