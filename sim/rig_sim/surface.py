"""Textured surfaces of a scene, and where rays meet them in closed form."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Texture = NDArray[np.float32]
Kind = Literal["rectangle", "disk", "sphere", "cylinder"]
FLAT: tuple[Kind, ...] = ("rectangle", "disk")

_NEAREST_HIT = 1e-6


@dataclass(frozen=True, eq=False)
class Shape:
    """A unit shape put into the world.

    Unit shapes: the rectangle |x|, |y| <= 1 and the disk x^2 + y^2 <= 1 in the plane z = 0; the
    sphere of radius 1; the cylinder x^2 + y^2 = 1 with 0 <= z <= 1. Texture coordinates (u, v):
    rectangle ((x + 1) / 2, (y + 1) / 2), disk (radius, angle / 2 pi), sphere (angle / 2 pi,
    polar angle / pi), cylinder (angle / 2 pi, z), where angle runs from x to y.
    """

    kind: Kind
    world_from_unit: Array
    """(4, 4), mm; spheres and cylinders only turned, moved and scaled evenly around the axis."""

    @cached_property
    def unit_from_world(self) -> Array:
        """Inverse of `world_from_unit`, (4, 4)."""
        return np.linalg.inv(self.world_from_unit).astype(np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A shape that gives off light as its texture says: outwards, flat ones towards z < 0.

    So whoever sees a rectangle's x run to the right and its y downwards sees the texture upright.
    """

    shape: Shape
    texture: Texture
    """(rows, columns) light, 1 = full scale; column 0 begins at u = 0, row 0 at v = 0."""


def cast(
    shapes: Sequence[Shape], origin_mm: Array, directions: Array
) -> tuple[Array, NDArray[np.intp]]:
    """Send rays to the first shape that they meet.

    Args:
        shapes: what may be met.
        origin_mm: start of the rays, (3,) or (..., 3).
        directions: (..., 3), of any length.

    Returns:
        Distance in units of the direction's length, infinite where nothing is met, and the number
        of the shape, -1 for none; both (...).
    """
    # Coordinates first: numpy runs several times faster over whole rows.
    origin = np.ascontiguousarray(np.broadcast_to(origin_mm, directions.shape).reshape(-1, 3).T)
    along = np.ascontiguousarray(directions.reshape(-1, 3).T)
    nearest = np.full(along.shape[1], np.inf)
    index = np.full(nearest.shape, -1, np.intp)
    for number, shape in enumerate(shapes):
        distance = _hits(shape, origin, along)
        closer = distance < nearest
        nearest[closer] = distance[closer]
        index[closer] = number
    return nearest.reshape(directions.shape[:-1]), index.reshape(directions.shape[:-1])


def _hits(shape: Shape, origin_mm: Array, directions: Array) -> Array:
    """Distance along rays (3, N) to one shape, (N,)."""
    turn = shape.unit_from_world[:3, :3]
    start = turn @ origin_mm + shape.unit_from_world[:3, 3:]
    along = turn @ directions
    with np.errstate(divide="ignore", invalid="ignore"):
        if shape.kind in FLAT:
            return _flat_hits(shape.kind, start, along)
        return _round_hits(shape.kind, start, along)


def _flat_hits(kind: Kind, start: Array, along: Array) -> Array:
    distance = -start[2] / along[2]
    x, y = start[:2] + distance * along[:2]
    if kind == "rectangle":
        inside = (np.abs(x) <= 1.0) & (np.abs(y) <= 1.0)
    else:
        inside = x * x + y * y <= 1.0
    return np.where(inside & (distance > _NEAREST_HIT), distance, np.inf)


def _round_hits(kind: Kind, start: Array, along: Array) -> Array:
    axes = 3 if kind == "sphere" else 2
    a = _dot(along[:axes], along[:axes])
    half_b = _dot(start[:axes], along[:axes])
    c = _dot(start[:axes], start[:axes]) - 1.0
    root = np.sqrt(half_b * half_b - a * c)  # NaN where the ray passes by: no comparison holds
    nearest = np.full(root.shape, np.inf)
    for distance in ((-half_b + root) / a, (-half_b - root) / a):
        met = distance > _NEAREST_HIT
        if kind == "cylinder":
            z = start[2] + distance * along[2]
            met &= (z >= 0.0) & (z <= 1.0)
        nearest[met] = np.minimum(distance, nearest)[met]
    return nearest


def _dot(left: Array, right: Array) -> Array:
    return np.einsum("in,in->n", left, right)
