"""The scenes by name: what never moves in them."""

from functools import cache
from typing import Literal

from rig_sim.scenes.bench import bench_surfaces
from rig_sim.scenes.desk import desk_things
from rig_sim.scenes.light import illuminate
from rig_sim.surface import Shape, Surface

Scene = Literal["board", "desk"]


@cache
def static_surfaces(scene: Scene) -> tuple[Surface, ...]:
    """Return all surfaces of a scene with their light; takes seconds for `desk`."""
    match scene:
        case "board":
            return bench_surfaces()
        case "desk":
            return illuminate(desk_things())


@cache
def static_shapes(scene: Scene) -> tuple[Shape, ...]:
    """Return the shapes alone, quickly."""
    things = bench_surfaces() if scene == "board" else desk_things()
    return tuple(thing.shape for thing in things)
