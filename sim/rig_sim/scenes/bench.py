"""The surroundings of the board: a painted wall and a bench top."""

import numpy as np

from rig_sim.scenes.place import rectangle
from rig_sim.surface import Surface
from rig_sim.textures import fractal

WALL_MM = 1400.0
BENCH_MM = 210.0
"""Height of the optical axis above the bench."""


def bench_surfaces() -> tuple[Surface, ...]:
    """Return wall and bench, darker than the board's paper and brighter than its ink."""
    rows, columns = 500, 1000
    downwards = np.linspace(0.40, 0.31, rows)[:, None]
    wall = (downwards + 0.02 * fractal((rows, columns), 11, fall=1.2)).astype(np.float32)
    bench = 0.26 + 0.03 * fractal((rows, columns), 12, fall=1.0)
    return (
        Surface(rectangle((0.0, 0.0, WALL_MM), (1400.0, 0.0, 0.0), (0.0, 700.0, 0.0)), wall),
        Surface(rectangle((0.0, BENCH_MM, 900.0), (1400.0, 0.0, 0.0), (0.0, 0.0, -700.0)), bench),
    )
