"""Put textured shapes into the world in the words of a scene: middle, axes, radius, ends."""

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import Vector
from sim.surface import Shape, Surface

Array = NDArray[np.float64]


def rectangle(
    centre_mm: Vector, right_mm: Vector, down_mm: Vector, texture: NDArray[np.floating]
) -> Surface:
    """Place a rectangle; `right_mm` and `down_mm` run from its middle to its edges.

    The texture is seen upright by whoever has the rectangle's right on the right and its down
    below; only that side is seen.
    """
    # The unit rectangle shows its front when x runs right and y up: the picture is flipped.
    up = -np.asarray(down_mm)
    shape = Shape("rectangle", _frame(centre_mm, right_mm, up))
    return Surface(shape, texture[::-1].astype(np.float32))


def _frame(centre_mm: Vector, x: Vector | Array, y: Vector | Array) -> Array:
    """Columns x, y, the unit normal x cross y, and the origin, as a (4, 4) matrix."""
    normal = np.cross(x, y)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1] = x, y
    matrix[:3, 2] = normal / np.linalg.norm(normal)
    matrix[:3, 3] = centre_mm
    return matrix
