"""Plain poles far before a weakly textured wall, on sparse views: how far their edges swell."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.hard_scenes import CROSS, DARK_LEVELS, ROW, Array, Still, texture
from benchmarks.slopes.scenes import Layout
from tests.support.lightfield import Surface, everywhere, plane

_RANGE_PX = (0.0, 48.0)
ROW_OF_POLES = Layout(ROW.x_steps, ROW.y_steps, ROW.shape, _RANGE_PX)
CROSS_OF_POLES = Layout(CROSS.x_steps, CROSS.y_steps, CROSS.shape, _RANGE_PX)


def poles(layout: Layout, seed: int, width_px: float, contrast: float) -> Still:
    """Dark poles, hardly leaning, every 120 px at a slope of 38, the wall at 8.

    Everything that the picture depends on is in the name, by which it is kept.
    """
    wall = Surface(plane(8.0), texture(seed, contrast), everywhere)

    def covers(u: Array, v: Array) -> NDArray[np.bool_]:
        across = np.mod(u - 0.03 * v - 23.0 * (seed % 3), 120.0)
        return np.abs(across - 60.0) < 0.5 * width_px

    front = Surface(plane(38.0), lambda u, v: DARK_LEVELS + 0.0 * (u + v), covers)
    name = f"poles of {width_px:g} px, contrast {contrast:g}"
    return Still(name, layout, (wall, front), seed)
