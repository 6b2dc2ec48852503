"""Daylight and a lamp: how much light falls on every surface, shadows included.

Computed once per scene and painted into the textures, so that rendering needs no secondary rays
and a picture has no noise from them. All surfaces scatter evenly (Lambert).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig_sim.scenes.materials import Recipe
from rig_sim.surface import FLAT, Shape, Surface, Texture, cast

Array = NDArray[np.float64]

DAYLIGHT = 0.6
"""Light from all around on an open surface, 1 = full scale on white."""
LAMP = 0.62
"""Light of the lamp on a surface at `LAMP_REACH_MM`, square to it."""
LAMP_REACH_MM = 1050.0
LAMP_CENTRE_MM = (-420.0, -560.0, 250.0)
LAMP_HALF_MM = 110.0

_LAMP_POINTS = 3
"""Per side of the square lamp."""
_SKY_RAYS = 20
_CELL_MM = 16.0
_FEWEST_CELLS, _MOST_CELLS = 4, 80
_OFF_SURFACE_MM = 0.5
_GOLDEN_RAD = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """A shape and what it is made of."""

    shape: Shape
    reflectance: Recipe


def illuminate(things: Sequence[Thing]) -> tuple[Surface, ...]:
    """Turn reflectance into light."""
    cells = [_cells(thing.shape) for thing in things]
    points_mm = np.concatenate([points.reshape(-1, 3) for points, _ in cells])
    normals = np.concatenate([normal.reshape(-1, 3) for _, normal in cells])
    points_mm += _OFF_SURFACE_MM * normals
    shapes = [thing.shape for thing in things]
    light = DAYLIGHT * _open_sky(shapes, points_mm, normals)
    light += LAMP * _lamp_light(shapes, points_mm, normals)
    ends = np.cumsum([points[..., 0].size for points, _ in cells])[:-1]
    return tuple(
        Surface(thing.shape, _painted(thing.reflectance(), part.reshape(points.shape[:2])))
        for thing, (points, _), part in zip(things, cells, np.split(light, ends), strict=True)
    )


def _painted(reflectance: Texture, light: Array) -> Texture:
    """Spread light from cells to texels."""
    rows, columns = reflectance.shape
    spread = cv2.resize(light.astype(np.float32), (columns, rows), interpolation=cv2.INTER_LINEAR)
    return (reflectance * spread).astype(np.float32, copy=False)


def _cells(shape: Shape) -> tuple[Array, Array]:
    """Points in the middle of a coarse grid of texture cells, and normals there, (v, u, 3)."""
    columns, rows = (
        int(np.clip(np.ceil(size_mm / _CELL_MM), _FEWEST_CELLS, _MOST_CELLS))
        for size_mm in _extent_mm(shape)
    )
    u, v = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    unit, unit_normal = _parametrised(shape, u, v)
    matrix = shape.world_from_unit
    points_mm = unit @ matrix[:3, :3].T + matrix[:3, 3]
    normals = unit_normal @ shape.unit_from_world[:3, :3]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    # Flat things are seen from z < 0.
    return points_mm, -normals if shape.kind in FLAT else normals


def _extent_mm(shape: Shape) -> tuple[float, float]:
    """Length of the shape along u and v, roughly."""
    x, y, z = np.linalg.norm(shape.world_from_unit[:3, :3], axis=0).tolist()
    match shape.kind:
        case "rectangle":
            return 2.0 * x, 2.0 * y
        case "disk":
            return max(x, y), 2.0 * np.pi * max(x, y)
        case "sphere":
            return 2.0 * np.pi * x, np.pi * x
        case "cylinder":
            return 2.0 * np.pi * x, z


def _parametrised(shape: Shape, u: Array, v: Array) -> tuple[Array, Array]:
    """Points (..., 3) and normals of a unit shape at texture coordinates."""
    zero, one = np.zeros_like(u), np.ones_like(u)
    up = np.stack([zero, zero, one], axis=-1)
    match shape.kind:
        case "rectangle":
            return np.stack([2.0 * u - 1.0, 2.0 * v - 1.0, zero], axis=-1), up
        case "disk":
            angle = 2.0 * np.pi * v
            return np.stack([u * np.cos(angle), u * np.sin(angle), zero], axis=-1), up
        case "sphere":
            angle, polar = 2.0 * np.pi * u, np.pi * v
            ring = np.sin(polar)
            point = np.stack([ring * np.cos(angle), ring * np.sin(angle), np.cos(polar)], axis=-1)
            return point, point
        case "cylinder":
            angle = 2.0 * np.pi * u
            outwards = np.stack([np.cos(angle), np.sin(angle), zero], axis=-1)
            return outwards + v[..., None] * up, outwards


def _open_sky(shapes: Sequence[Shape], points_mm: Array, normals: Array) -> Array:
    """Share of the daylight that is not kept off by something else, cosine-weighted."""
    number = np.arange(_SKY_RAYS) + 0.5
    radius, angle = np.sqrt(number / _SKY_RAYS), number * _GOLDEN_RAD
    local = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)], -1)
    across = np.cross(normals, np.where(np.abs(normals[..., :1]) < 0.5, [1, 0, 0], [0, 1, 0]))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    frame = np.stack([across, np.cross(normals, across), normals], axis=-1)
    free = np.zeros(points_mm.shape[:-1])
    for direction in local:
        # What is farther than the desk is wide is room, and the room is bright.
        free += np.minimum(cast(shapes, points_mm, frame @ direction)[0] / 500.0, 1.0)
    return free / _SKY_RAYS


def _lamp_light(shapes: Sequence[Shape], points_mm: Array, normals: Array) -> Array:
    """Light from a square lamp, with soft shadows, 1 at `LAMP_REACH_MM` and square to it."""
    steps = ((np.arange(_LAMP_POINTS) + 0.5) / _LAMP_POINTS * 2.0 - 1.0) * LAMP_HALF_MM
    light = np.zeros(points_mm.shape[:-1])
    for dx in steps:
        for dz in steps:
            away = np.add(LAMP_CENTRE_MM, (dx, 0.0, dz)) - points_mm
            distance_mm = np.linalg.norm(away, axis=-1)
            slant = np.maximum(np.sum(away * normals, axis=-1) / distance_mm, 0.0)
            reached = cast(shapes, points_mm, away)[0] > 1.0
            light += reached * slant * (LAMP_REACH_MM / distance_mm) ** 2
    return light / _LAMP_POINTS**2
