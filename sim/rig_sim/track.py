"""Where the camera of a scan is: one slider along the row, perhaps one along the column."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.devices import Clock
from rig.errors import ConfigError
from rig.profile import Profile, ScanCameraConfig
from rig.profile.world import SliderConfig, Vector
from rig_sim.carriage import Carriage

Array = NDArray[np.float64]
Along = Literal["row", "column"]


def direction(config: SliderConfig, along: Along) -> Array:
    """Return the unit vector of travel in the frame of the camera, x right, y down, z forward."""
    forward, roll = math.radians(config.forward_deg), math.radians(config.roll_deg)
    ahead, aside = math.cos(forward) * math.cos(roll), math.cos(forward) * math.sin(roll)
    across = (ahead, aside) if along == "row" else (-aside, ahead)
    return np.array([*across, math.sin(forward)])


@dataclass(frozen=True, slots=True)
class Slider:
    """One stage of the camera: its mechanics, and the track that they run on."""

    config: SliderConfig
    carriage: Carriage
    along: Along
    reference_mm: float
    """Machine coordinate at which the reference view is taken."""

    def place_mm(self, travelled_mm: float) -> Array:
        """Return the place of the camera after a true displacement from machine zero."""
        config = self.config
        way_mm = config.camera_at_machine_zero_mm + travelled_mm
        sag_mm = config.bow_mm * (way_mm / config.bow_length_mm) ** 2
        aside = np.array([0.0, 1.0, 0.0] if self.along == "row" else [1.0, 0.0, 0.0])
        return way_mm * direction(config, self.along) + sag_mm * aside


@dataclass(frozen=True, slots=True)
class Track:
    """The sliders of one camera, by the name of their stage in the profile."""

    sliders: Mapping[str, Slider]

    def camera_mm(self, t_s: float) -> Vector:
        """Return the true place of the camera at `t_s`."""
        return _vector(sum(s.place_mm(s.carriage.travelled_mm(t_s)) for s in self.sliders.values()))

    def place_mm(self, machine_mm: Mapping[str, float]) -> Vector:
        """Return the true place of the camera at rest at machine coordinates, by slider."""
        return _vector(
            sum(s.place_mm(s.config.scale * machine_mm[n]) for n, s in self.sliders.items())
        )

    @property
    def reference_mm(self) -> Vector:
        """True place of the reference view."""
        return self.place_mm({name: s.reference_mm for name, s in self.sliders.items()})


def track_of(profile: Profile, clock: Clock) -> Track | None:
    """Return what carries the camera of a profile's world; None where its cameras stand.

    Raises:
        ConfigError: the world lacks a slider.
    """
    camera, world = profile.camera, profile.world
    if not isinstance(camera, ScanCameraConfig) or world is None:
        return None
    paths = {"camera": camera.row, "column": camera.column}
    configs = {"camera": world.slider, "column": world.column}
    sliders: dict[str, Slider] = {}
    for name, stage in profile.stages.carriers.items():
        config, path = configs[name], paths[name]
        along: Along = "row" if name == "camera" else "column"
        if config is None or path is None:
            key = "slider" if name == "camera" else "column"
            raise ConfigError(
                f"profile {profile.name}: a simulated camera that moves needs [world.{key}]",
                advice="add it to the file",
            )
        zero_mm = getattr(stage, "distance_at_machine_zero_mm", 0.0)
        turn = getattr(stage, "direction", 1)
        reference_mm = (path.reference_mm - zero_mm) * turn
        sliders[name] = Slider(config, Carriage(config, clock), along, reference_mm)
    return Track(sliders)


def _vector(place_mm: object) -> Vector:
    x_mm, y_mm, z_mm = np.asarray(place_mm, np.float64).tolist()
    return x_mm, y_mm, z_mm
