"""Synthetic light fields with exact slopes: textured surfaces composited with occlusion.

A surface is a slope function of the reference pixel with a texture glued to reference coordinates,
so every view is an exact re-sampling of continuous functions; a pixel is the mean of a grid of
point samples. Shares nothing with `rig`: a mistake there cannot cancel itself out here.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Field = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Surface:
    """Slope, grey value and extent of one object, as functions of reference coordinates (u, v)."""

    slope_px: Field
    grey: Field
    covers: Callable[[Array, Array], NDArray[np.bool_]]


def everywhere(u: Array, v: Array) -> NDArray[np.bool_]:
    return np.ones(np.broadcast(u, v).shape, bool)


def disc(centre: tuple[float, float], radius_px: float) -> Callable[..., NDArray[np.bool_]]:
    return lambda u, v: np.hypot(u - centre[0], v - centre[1]) < radius_px


def box(left: float, top: float, right: float, bottom: float) -> Callable[..., NDArray[np.bool_]]:
    return lambda u, v: (u > left) & (u < right) & (v > top) & (v < bottom)


def plane(at_origin_px: float, per_u: float = 0.0, per_v: float = 0.0) -> Field:
    return lambda u, v: at_origin_px + per_u * u + per_v * v


def bump(centre: tuple[float, float], radius_px: float, rim_px: float, top_px: float) -> Field:
    """A spherical cap: slope `rim_px` at its rim, `top_px` in the middle."""

    def slope(u: Array, v: Array) -> Array:
        r2 = ((u - centre[0]) ** 2 + (v - centre[1]) ** 2) / radius_px**2
        return rim_px + (top_px - rim_px) * np.clip(1.0 - r2, 0.0, None)

    return slope


def noise_texture(
    seed: int, *, mean: float, contrast: float, finest_px: float, octaves: int = 4
) -> Field:
    """Band-limited random texture: octaves of cubic-interpolated lattice noise.

    `finest_px` is the lattice spacing of the finest octave; coarser ones are twice as strong.
    """
    rng = np.random.default_rng(seed)
    size = 256
    lattices = rng.standard_normal((octaves, size, size))
    angles = rng.uniform(0, np.pi, octaves)
    weights = 1.3 ** np.arange(octaves)
    weights /= np.sqrt((weights**2).sum())

    def grey(u: Array, v: Array) -> Array:
        total = np.zeros(np.broadcast(u, v).shape)
        for octave in range(octaves):
            spacing = finest_px * 2.0**octave
            c, s = np.cos(angles[octave]) / spacing, np.sin(angles[octave]) / spacing
            total += weights[octave] * _cubic(lattices[octave], c * u - s * v, s * u + c * v)
        return mean + contrast * total

    return grey


def _cubic(lattice: Array, x: Array, y: Array) -> Array:
    """Uniform cubic B-spline over a periodic lattice: smooth, no texture finer than the lattice."""
    size = lattice.shape[0]
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    wx, wy = _weights(x - ix), _weights(y - iy)
    out = np.zeros(np.broadcast(x, y).shape)
    for j in range(4):
        row = ((iy + j - 1) % size) * size
        for i in range(4):
            out += wy[j] * wx[i] * lattice.ravel()[row + (ix + i - 1) % size]
    return out * 2.25


def _weights(t: Array) -> tuple[Array, Array, Array, Array]:
    return (
        (1 - t) ** 3 / 6,
        (3 * t**3 - 6 * t**2 + 4) / 6,
        (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6,
        t**3 / 6,
    )


def render_view(
    surfaces: list[Surface], shape: tuple[int, int], x_step: float, y_step: float, supersample: int
) -> Array:
    """One view (H, W); `surfaces` from the farthest to the nearest."""
    height, width = shape
    offsets = (np.arange(supersample) + 0.5) / supersample - 0.5
    total = np.zeros(shape)
    rows, columns = np.mgrid[0:height, 0:width].astype(float)
    for dy in offsets:
        for dx in offsets:
            total += _point_samples(surfaces, columns + dx, rows + dy, x_step, y_step)
    return total / supersample**2


def _point_samples(
    surfaces: list[Surface], p: Array, q: Array, x_step: float, y_step: float
) -> Array:
    grey = np.zeros(p.shape)
    for surface in surfaces:
        u, v = p, q
        for _ in range(30):  # p = u - m(u, v) x contracts while |dm/du| |x| < 1
            m = surface.slope_px(u, v)
            moved_u, moved_v = p + m * x_step, q + m * y_step
            done = max(np.abs(moved_u - u).max(), np.abs(moved_v - v).max()) < 1e-9
            u, v = moved_u, moved_v
            if done:
                break
        inside = surface.covers(u, v)
        grey[inside] = surface.grey(u[inside], v[inside])
    return grey


def true_slope_px(surfaces: list[Surface], shape: tuple[int, int]) -> Array:
    """Slope of the nearest surface at every pixel centre of the reference view, (H, W)."""
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]].astype(float)
    slope = np.full(shape, np.nan)
    for surface in surfaces:
        inside = surface.covers(columns, rows)
        slope[inside] = surface.slope_px(columns, rows)[inside]
    return slope


def render_views(
    surfaces: list[Surface],
    shape: tuple[int, int],
    x_steps: Array,
    y_steps: Array,
    supersample: int = 3,
) -> Array:
    """All views, (V, H, W) float64 grey values."""
    return np.stack(
        [
            render_view(surfaces, shape, float(x), float(y), supersample)
            for x, y in zip(x_steps, y_steps, strict=True)
        ]
    )


def expose(
    views: Array, *, noise: float, gain_spread: float = 0.0, seed: int = 0
) -> NDArray[np.uint8]:
    """8-bit frames with white noise (grey levels, 1 sigma) and one gain per view."""
    rng = np.random.default_rng(seed)
    gains = 1.0 + gain_spread * rng.standard_normal(len(views))
    noisy = views * gains[:, None, None] + noise * rng.standard_normal(views.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def expose_to_light(
    views: Array,
    *,
    read_noise_levels: float,
    electrons_per_level: float,
    gain_spread: float,
    seed: int = 0,
) -> NDArray[np.uint8]:
    """8-bit frames of a sensor that counts photons: variance = read noise^2 + grey / gain."""
    rng = np.random.default_rng(seed)
    gains = 1.0 + gain_spread * rng.standard_normal(len(views))
    grey = np.clip(views, 0, None) * gains[:, None, None]
    electrons = rng.poisson(grey * electrons_per_level)
    read = read_noise_levels * rng.standard_normal(grey.shape)
    return np.clip(np.rint(electrons / electrons_per_level + read), 0, 255).astype(np.uint8)
