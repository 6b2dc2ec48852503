"""Textured surfaces of a scene, and where rays meet them in closed form."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Texture = NDArray[np.float32]
Kind = Literal["rectangle", "disk", "sphere", "cylinder"]

_NEAREST_HIT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A unit shape put into the world.

    Unit shapes: the rectangle |x|, |y| <= 1 and the disk x^2 + y^2 <= 1 in the plane z = 0; the
    sphere of radius 1; the cylinder x^2 + y^2 = 1 with 0 <= z <= 1.
    """

    kind: Kind
    world_from_unit: Array
    """(4, 4), mm; spheres and cylinders only turned, moved and scaled evenly around the axis."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A shape that gives off light as its texture says, flat shapes only towards z > 0.

    Texture coordinates: rectangle ((x + 1) / 2, (y + 1) / 2), disk (radius, angle / 2 pi),
    sphere (longitude / 2 pi, polar angle / pi), cylinder (angle / 2 pi, z).
    """

    shape: Shape
    radiance: Texture
    """(rows, columns) light, 1 = full scale; column 0 begins at u = 0, row 0 at v = 0."""


def hits(shape: Shape, origin_mm: Array, directions: Array) -> Array:
    """Return how far along each ray the shape is first met, in units of the direction; inf: never.

    Args:
        shape: what may be hit.
        origin_mm: start of the rays, (3,) or (..., 3).
        directions: (..., 3), of any length.
    """
    unit_from_world = np.linalg.inv(shape.world_from_unit)
    start = origin_mm @ unit_from_world[:3, :3].T + unit_from_world[:3, 3]
    along = directions @ unit_from_world[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        if shape.kind in ("rectangle", "disk"):
            return _flat_hits(shape.kind, start, along)
        return _round_hits(shape.kind, start, along)


def cast(
    shapes: Sequence[Shape], origin_mm: Array, directions: Array
) -> tuple[Array, NDArray[np.intp]]:
    """Return distance along every ray to the first shape (inf: none) and that shape's index."""
    nearest = np.full(directions.shape[:-1], np.inf)
    index = np.full(nearest.shape, -1, np.intp)
    for number, shape in enumerate(shapes):
        distance = hits(shape, origin_mm, directions)
        closer = distance < nearest
        nearest[closer] = distance[closer]
        index[closer] = number
    return nearest, index


def _flat_hits(kind: Kind, start: Array, along: Array) -> Array:
    distance = -start[..., 2] / along[..., 2]
    x = start[..., 0] + distance * along[..., 0]
    y = start[..., 1] + distance * along[..., 1]
    if kind == "rectangle":
        inside = (np.abs(x) <= 1.0) & (np.abs(y) <= 1.0)
    else:
        inside = x * x + y * y <= 1.0
    return np.where(inside & (distance > _NEAREST_HIT), distance, np.inf)


def _round_hits(kind: Kind, start: Array, along: Array) -> Array:
    axes = 3 if kind == "sphere" else 2
    start_across, along_across = start[..., :axes], along[..., :axes]
    a = np.sum(along_across * along_across, axis=-1)
    half_b = np.sum(start_across * along_across, axis=-1)
    c = np.sum(start_across * start_across, axis=-1) - 1.0
    root = np.sqrt(half_b * half_b - a * c)  # NaN where the ray passes by
    nearest = np.full(root.shape, np.inf)
    for distance in ((-half_b + root) / a, (-half_b - root) / a):
        met = distance > _NEAREST_HIT
        if kind == "cylinder":
            z = start[..., 2] + distance * along[..., 2]
            met &= (z >= 0.0) & (z <= 1.0)
        nearest = np.where(met, np.minimum(distance, nearest), nearest)
    return nearest
