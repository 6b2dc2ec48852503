"""The scenes by name."""

from functools import cache
from typing import Literal

from sim.scenes.bench import bench_surfaces
from sim.scenes.desk import desk_surfaces
from sim.surface import Surface

Scene = Literal["board", "desk"]


@cache
def static_surfaces(scene: Scene) -> tuple[Surface, ...]:
    """Return everything in a scene that never moves."""
    match scene:
        case "board":
            return bench_surfaces()
        case "desk":
            return desk_surfaces()
