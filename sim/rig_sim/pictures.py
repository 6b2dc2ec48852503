"""Noise-free pictures of a World, each rendered once."""

import hashlib
import json
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import ViewErrorConfig, WorldConfig
from rig_sim.cache import PictureCache, cache_folder
from rig_sim.noise import Exposure, ViewExposure
from rig_sim.render_analytic import AnalyticRenderer
from rig_sim.render_mitsuba import MitsubaRenderer
from rig_sim.world import Moment, World

Picture = NDArray[np.float32]

_MOMENTS_KEPT = 3
_TINT = (np.float32(1.0), np.float32(0.8), np.float32(0.5))
"""Share of the light that red, green and blue get of a warm lamp."""


class Renderer(Protocol):
    """Turns a moment of the World into light."""

    name: str
    """What else than the moment the pictures depend on."""

    def render(self, moment: Moment) -> Sequence[Picture]:
        """Return noise-free, unblurred light of all views, (H, W) each, 1 = full scale."""
        ...


class CachedRenderer:
    """A slow renderer whose pictures are kept on disk."""

    def __init__(self, renderer: Renderer, cache: PictureCache) -> None:
        self.name = renderer.name
        self._renderer = renderer
        self._cache = cache

    def render(self, moment: Moment) -> Sequence[Picture]:
        """See `Renderer.render`; rounded to 16 bit, whether stored or new."""
        key = self._key(moment)
        shapes = [(camera.height_px, camera.width_px) for camera in moment.cameras]
        stored = self._cache.load(key, shapes)
        return self._cache.store(key, self._renderer.render(moment)) if stored is None else stored

    def _key(self, moment: Moment) -> str:
        content = json.dumps([self.name, _source(), asdict(moment)])
        return hashlib.sha256(content.encode()).hexdigest()


class Exposures:
    """Exposures of the World's moments, the latest few kept in memory.

    Args:
        world: what is seen.
        in_colour: whether red, green and blue are exposed as well.
    """

    def __init__(self, world: World, *, in_colour: bool = False) -> None:
        self._world = world
        self._tint = _TINT if in_colour else ()
        self._renderer = _renderer(world.config)
        self._kept: OrderedDict[tuple[Moment, float], tuple[ViewExposure, ...]] = OrderedDict()

    @property
    def renderer(self) -> str:
        """Name of the renderer."""
        return self._renderer.name

    def at(self, t_s: float) -> tuple[ViewExposure, ...]:
        """Return the exposure of every view at `t_s`, in the profile's order."""
        key = (self._world.moment(t_s), self._world.lamp(t_s))
        if key not in self._kept:
            self._kept[key] = self._expose(*key)
            if len(self._kept) > _MOMENTS_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]

    def _expose(self, moment: Moment, lamp: float) -> tuple[ViewExposure, ...]:
        lights = self._renderer.render(moment)
        if lamp != 1.0:
            lights = tuple(light * np.float32(lamp) for light in lights)
        return tuple(
            ViewExposure(
                self._of(camera.view, light),
                tuple(self._of(camera.view, light * share) for share in self._tint),
            )
            for camera, light in zip(moment.cameras, lights, strict=True)
        )

    def _of(self, view: str, light: Picture) -> Exposure:
        config = self._world.config
        error = config.view_errors.get(view, ViewErrorConfig())
        return Exposure.of(light, config.sensor, error, blur_px=config.optics.blur_px)


def _renderer(config: WorldConfig) -> Renderer:
    if config.renderer == "analytic":
        return AnalyticRenderer()
    mitsuba = MitsubaRenderer(samples_per_px=config.samples_per_px, seed=config.seed)
    return CachedRenderer(mitsuba, PictureCache(cache_folder()))


@cache
def _source() -> str:
    """Fingerprint of this package's source: scenes and renderers are part of every picture."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
