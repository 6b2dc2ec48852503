"""Views of painted walls through the lenslets of profile `sim-lenslet`."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from rig_sim.lenslets.light import Picture, RawLight
from rig_sim.lenslets.wall import Wall
from rig_sim.noise import Exposure

from rig.arrays import Float
from rig.epipolar import RectifiedViews
from rig.frames import GreyImage
from rig.lenslet.array import LensletArray, fit_array
from rig.lenslet.plan import Plan, plan_views
from rig.lenslet.views import sub_apertures
from rig.lenslet.white import RawFormat
from rig.profile import LensletCameraConfig, LensletWorldConfig, Profile, WorldConfig
from rig.profile.load import load_profile
from rig.profile.world import ViewErrorConfig

_WHITES = 4


@dataclass(frozen=True)
class Box:
    """The camera of `sim-lenslet` with a raw picture of another size."""

    width_px: int
    height_px: int

    @cached_property
    def _profile(self) -> Profile:
        size = (f"camera.raw.width_px={self.width_px}", f"camera.raw.height_px={self.height_px}")
        return load_profile("sim-lenslet", size)

    @cached_property
    def _world(self) -> WorldConfig:
        world = self._profile.world
        assert world is not None
        return world

    @cached_property
    def _light(self) -> RawLight:
        world = self._world
        assert isinstance(world.lenslets, LensletWorldConfig)
        size_px = (self.width_px, self.height_px)
        return RawLight(world, world.lenslets, self._profile.pitch_mm, size_px)

    @cached_property
    def _places(self) -> Float:
        return np.array([(view.x_steps, view.y_steps) for view in self._profile.views])

    @cached_property
    def _calibrated(self) -> tuple[LensletArray, Plan]:
        camera = self._profile.camera
        assert isinstance(camera, LensletCameraConfig)
        white = self._light.white()
        shots = [self._exposed(white, 100 + n).astype(np.float64) for n in range(_WHITES)]
        form = RawFormat(65535, camera.is_bayer, camera.dark_levels)
        white = np.mean(shots, axis=0)
        array, _ = fit_array(white, form, camera.lattice, camera.spacing_px)
        return array, plan_views(array, self._places * camera.step_px)

    def slope_px(self, distance_mm: float) -> float:
        """The true slope of what is so far away."""
        optics = self._world.optics
        per_step = optics.focal_px * self._profile.pitch_mm
        return per_step * (1.0 / distance_mm - 1.0 / optics.focus_mm)

    def wall(self, distance_mm: float, finest_per_px: float, seed: int = 1) -> Wall:
        """A wall whose finest wave has so many periods per pixel of a view."""
        finest_per_mm = finest_per_px * self._world.optics.focal_px / distance_mm
        return Wall.random(distance_mm, finest_per_mm, 0.2, seed)

    def views(self, wall: Wall, seed: int) -> RectifiedViews:
        """What the camera gives of a wall; noise by the seed."""
        array, plan = self._calibrated
        raw = self._exposed(self._light.of_wall(wall), seed)
        images = sub_apertures(raw, array, plan)
        reference = self._profile.reference
        return RectifiedViews(images, self._places[:, 0], self._places[:, 1], reference)

    def _exposed(self, light: Picture, seed: int) -> GreyImage:
        sensor = self._world.sensor
        return Exposure.of(light, sensor, ViewErrorConfig(), blur_px=0.0).draw((seed,))
