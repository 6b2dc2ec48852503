"""A still life on a desk."""

from sim.scenes.bench import bench_surfaces
from sim.surface import Surface


def desk_surfaces() -> tuple[Surface, ...]:
    """Return everything on the desk."""
    return bench_surfaces()
