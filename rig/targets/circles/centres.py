"""Sub-pixel middles of dark ellipses: the centroid of what they take from the light of the paper.

The paper's light about a circle is a plane through the white ring around it; what the circle takes
of it, as a share, does not change with shading. Its centroid is that of the ellipse, however
blurred. That is not where the circle's centre appears: see `rig.geometry.circle_bias`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.targets.circles.grid import CircleGrid
from rig.targets.pyramid import Picture

_BLOB_GAP, _RING_GAP = 0.42, 0.62
"""Where the blob's window ends and the white ring around it ends, in gaps beyond its edge: the
next circle begins at 1."""
_WIDE_EDGE = 2.563
"""Width of a blurred edge from 10 to 90 per cent, in its sigmas."""
_UNKNOWN = (np.nan, np.nan, np.nan, np.nan, np.nan)
_ROUNDS = 6
_MOST_SIGMAS = 4.0
_LEAST_NOISE = 0.3
"""Grey levels: rounding, in pictures without other noise."""
_LEAST_PAPER = 0.6
"""Share of the ring that must be paper."""
_LEAST_RING = 12
"""Pixels that fix a plane with something to spare."""


@dataclass(frozen=True, slots=True)
class Centres:
    """N measured ellipses; NaN where one could not be measured."""

    xy_px: Float
    """(N, 2)."""
    sigma_px: Float
    """(N,) 1 sigma per coordinate, from the noise of the paper."""
    blur_px: Float
    """(N,) sigma of the edges."""
    contrast: Float
    """(N,) white minus black, grey levels."""


def measure_centres(picture: Picture, start_px: Float, grid: CircleGrid) -> Centres:
    """Measure all circles of a grid.

    Args:
        picture: (H, W) grey.
        start_px: (rows * columns, 2) middles to a pixel or two.
        grid: which gives every circle its shape in the picture, by its neighbours.
    """
    shapes = _pixels_per_mm(start_px, grid)
    found = [
        _measure(picture, place, shape, grid) for place, shape in zip(start_px, shapes, strict=True)
    ]
    values = np.array(found)
    return Centres(values[:, :2], values[:, 2], values[:, 3], values[:, 4])


def _pixels_per_mm(xy_px: Float, grid: CircleGrid) -> Float:
    """(N, 2, 2) how pixels move with millimetres on the board, by each circle's neighbours."""
    plane_mm = grid.points_mm.reshape(-1, 3)[:, :2]
    shapes = np.empty((len(xy_px), 2, 2))
    for n, place in enumerate(plane_mm):
        apart = np.linalg.norm(plane_mm - place, axis=1)
        near = np.argsort(apart, kind="stable")[:7]
        moved, _, _, _ = np.linalg.lstsq(
            np.column_stack([plane_mm[near] - place, np.ones(len(near))]), xy_px[near], rcond=None
        )
        shapes[n] = moved[:2].T
    return shapes


def _measure(
    picture: Picture, place_px: Float, shape: Float, grid: CircleGrid
) -> tuple[float, float, float, float, float]:
    radius_mm = grid.diameter_mm / 2
    reach_mm = radius_mm + _RING_GAP * grid.gap_mm
    half_px = reach_mm * np.linalg.norm(shape, axis=1)
    low = np.floor(place_px - half_px).astype(int)
    high = np.ceil(place_px + half_px).astype(int) + 1
    if (low < 0).any() or (high > np.array(picture.shape[::-1])).any():
        return _UNKNOWN
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    grey = picture[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    away = np.stack([x - place_px[0], y - place_px[1]], axis=-1)
    far_mm = np.linalg.norm(away @ np.linalg.inv(shape).T, axis=-1)
    ring = (far_mm > radius_mm + _BLOB_GAP * grid.gap_mm) & (far_mm <= reach_mm)
    window = far_mm <= radius_mm + _BLOB_GAP * grid.gap_mm
    core = far_mm < 0.5 * radius_mm
    if ring.sum() < _LEAST_RING or not core.any():
        return _UNKNOWN
    design = np.stack([away[..., 0], away[..., 1], np.ones_like(x)], axis=-1)
    plane = _paper(design, grey, ring)
    if plane is None:
        return _UNKNOWN
    paper = design @ plane
    noise = float(np.std(grey[ring] - paper[ring])) / max(float(plane[2]), 1e-9)
    taken = 1.0 - grey / np.maximum(paper, 1e-9)
    total = float(taken[window].sum())
    deep = float(np.median(taken[core]))
    if not (total > 0 and deep > 0):
        return _UNKNOWN
    offset = (taken[window][:, None] * away[window]).sum(axis=0) / total
    lever = float(np.mean(np.sum((away[window] - offset) ** 2, axis=1))) / 2.0
    spread = window.sum() * lever
    # Noise within the window, and that of the plane's slope, which tilts all of it.
    ring_spread = float(np.sum(away[ring] ** 2)) / 2.0
    sigma_px = noise * np.sqrt(spread + spread**2 / ring_spread) / total
    area_px2 = np.pi * radius_mm**2 * abs(float(np.linalg.det(shape)))
    around_px = 2.0 * np.sqrt(np.pi * area_px2)
    share = taken[window] / deep
    blur_px = float(((share > 0.1) & (share < 0.9)).sum()) / around_px / _WIDE_EDGE
    x_px, y_px = (place_px + offset).tolist()
    return x_px, y_px, float(sigma_px), blur_px, deep * float(plane[2])


def _paper(design: Float, grey: Float, ring: NDArray[np.bool_]) -> Float | None:
    """Plane (3,) of the paper's light; takes what is no paper out of the ring.

    None where too little of the ring is left.
    """
    asked = int(ring.sum())
    plane = _plane(design, grey, ring)
    for _ in range(_ROUNDS):
        away = np.abs(grey - design @ plane)
        scale = 1.4826 * float(np.median(away[ring])) + _LEAST_NOISE
        stranger = ring & (away > _MOST_SIGMAS * scale)
        if not stranger.any():
            break
        ring &= ~stranger
        if ring.sum() < max(_LEAST_RING, _LEAST_PAPER * asked):
            return None
        plane = _plane(design, grey, ring)
    return plane


def _plane(design: Float, grey: Float, ring: NDArray[np.bool_]) -> Float:
    return np.asarray(np.linalg.lstsq(design[ring], grey[ring], rcond=None)[0], np.float64)
