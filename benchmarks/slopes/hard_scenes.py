"""Scenes in closed form that a camera meets and a matcher fears, with exact slopes."""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import DENSE, Layout, Scene
from benchmarks.slopes.stored import stored
from rig.epipolar import RectifiedViews
from tests.support.lightfield import (
    Field,
    Surface,
    box,
    everywhere,
    expose,
    plane,
    render_views,
    true_slope_px,
)

Array = NDArray[np.float64]
Covers = Callable[[Array, Array], NDArray[np.bool_]]

SHAPE, RANGE_PX = (400, 640), (0.0, 16.0)
_ARM = np.array([0.0, -1.0, 1.0])
ROW = Layout(np.array([0, -1.0, 1.0, -2.0, 2.0]), np.zeros(5), SHAPE, RANGE_PX)
CROSS = Layout(np.r_[_ARM, 0, 0], np.r_[0, 0, 0, _ARM[1:]], SHAPE, RANGE_PX)
UNEVEN = Layout(np.array([0, -2.37, -1.0, 1.43, 2.61]), np.zeros(5), SHAPE, RANGE_PX)
ROW_OF_9 = Layout(DENSE.x_steps[:9], np.zeros(9), (160, 256), (-2.0, 2.0))

WALL_PX, FRONT_PX = 3.0, 10.0
SQUARE_PX = 220, 110, 420, 290
"""Left, top, right, bottom of the textured square in front of a plain wall."""
DARK_LEVELS, GREY_LEVELS = 30.0, 85.0
_WAVES = 28


@dataclass(frozen=True)
class Still:
    """A scene to be rendered: a name that says all, and its surfaces from far to near."""

    name: str
    layout: Layout
    surfaces: tuple[Surface, ...]
    seed: int
    supersample: int = 2
    reflected: tuple[Surface, ...] = ()
    """Where there are some: half of the light comes from these surfaces instead."""
    by_column: tuple[Surface, ...] = ()
    """Where there are some: what the views off the row see instead."""


def make_still(still: Still, noise_levels: float, half: str) -> Scene:
    """Render it (kept on disk) and expose it; gains differ by 2 %."""
    layout = still.layout
    told = f"{still.name} {still.seed} {layout} {still.supersample}"
    clean = stored(lambda: _render(still), told, sys.modules[__name__])
    frames = expose(clean.astype(np.float64), noise=noise_levels, gain_spread=0.02, seed=still.seed)
    return Scene(
        f"{still.name}, noise {noise_levels:g}",
        RectifiedViews(frames, layout.x_steps, layout.y_steps, 0),
        true_slope_px(list(still.surfaces), layout.shape),
        layout.range_px,
        border_px=0,
        noise_levels=noise_levels,
        clean=clean,
        gain_spread=0.02,
        half=half,
    )


def _render(still: Still) -> Array:
    layout = still.layout

    def views(surfaces: tuple[Surface, ...]) -> Array:
        return render_views(
            list(surfaces), layout.shape, layout.x_steps, layout.y_steps, still.supersample
        )

    seen = views(still.surfaces)
    if still.by_column:
        seen = np.where((layout.y_steps != 0.0)[:, None, None], views(still.by_column), seen)
    return 0.5 * (seen + views(still.reflected)) if still.reflected else seen


def texture(seed: int, contrast: float = 25.0, mean: float = 125.0) -> Field:
    """Plane waves of random directions and phases, wavelengths of 3.5..40 px: a random field."""
    rng = np.random.default_rng(seed)
    number = 2.0 * np.pi / np.exp(rng.uniform(np.log(3.5), np.log(40.0), _WAVES))
    angle, phase = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES))
    along, down = number * np.cos(angle), number * np.sin(angle)
    height = contrast * np.sqrt(2.0 / _WAVES)

    def grey(u: Array, v: Array) -> Array:
        total = np.full(np.broadcast(u, v).shape, mean)
        for a, b, start in zip(along, down, phase, strict=True):
            total += height * np.sin(a * u + b * v + start)
        return total

    return grey


def _textured_wall(seed: int) -> Surface:
    return Surface(plane(WALL_PX), texture(seed), everywhere)


def plain_wall(layout: Layout, seed: int, *, shaded: bool) -> Still:
    """A wall without texture behind a textured square; light may fall off smoothly."""

    def grey(u: Array, v: Array) -> Array:
        if not shaded:
            return np.full(np.broadcast(u, v).shape, 120.0)
        return 120.0 + 40.0 * np.exp(-((u - 150.0) ** 2 + (v - 80.0 - seed % 7) ** 2) / 250.0**2)

    surfaces = (
        Surface(plane(WALL_PX), grey, everywhere),
        Surface(plane(FRONT_PX), texture(seed), box(*SQUARE_PX)),
    )
    return Still("shaded wall" if shaded else "plain wall", layout, surfaces, seed)


def stripes(layout: Layout, seed: int) -> Still:
    """Horizontal stripes, no two alike: nothing tells a row of views how far they are."""
    lines = texture(seed, 35.0)

    def grey(u: Array, v: Array) -> Array:
        return lines(0.0 * u, v)

    return Still("level stripes", layout, (Surface(plane(WALL_PX), grey, everywhere),), seed)


def sine(layout: Layout, seed: int, period_px: float, name: str) -> Still:
    """Upright stripes that repeat: as many slopes fit as the range has periods."""
    phase = 0.7 * seed

    def grey(u: Array, v: Array) -> Array:
        return 120.0 + 45.0 * np.sin(2.0 * np.pi * u / period_px + phase) + 0.0 * v

    surface = Surface(plane(WALL_PX + 0.3), grey, everywhere)
    return Still(f"sine of {period_px:g} px, {name}", layout, (surface,), seed)


def wires(layout: Layout, seed: int, width_px: float, levels: float = DARK_LEVELS) -> Still:
    """Upright wires of one grey value, hardly leaning, every 48 px before a textured wall."""

    def covers(u: Array, v: Array) -> NDArray[np.bool_]:
        across = np.mod(u - 0.03 * v - 17.0 * (seed % 3), 48.0)
        return np.abs(across - 24.0) < 0.5 * width_px

    front = Surface(plane(FRONT_PX), lambda u, v: levels + 0.0 * (u + v), covers)
    name = f"{'dark' if levels <= DARK_LEVELS else 'grey'} wires of {width_px:g} px"
    return Still(name, layout, (_textured_wall(seed), front), seed, supersample=4)


def mesh(layout: Layout, seed: int) -> Still:
    """A basket of 3 px wires, 18 px apart, before a textured wall."""

    def covers(u: Array, v: Array) -> NDArray[np.bool_]:
        a, b = np.mod(u + 0.05 * v, 18.0), np.mod(v - 0.05 * u + seed % 5, 18.0)
        return (np.abs(a - 9.0) < 1.5) | (np.abs(b - 9.0) < 1.5)

    front = Surface(plane(FRONT_PX), texture(seed + 1, 6.0, mean=60.0), covers)
    return Still("wire mesh", layout, (_textured_wall(seed), front), seed, supersample=3)


def leaves(layout: Layout, seed: int) -> Still:
    """Thin leaves one over another, at slopes of 5..13, before a textured wall."""
    rng = np.random.default_rng(seed)
    height, width = layout.shape
    surfaces = [_textured_wall(seed)]
    for k, slope in enumerate(np.linspace(5.0, 13.0, 160)):
        centre = rng.uniform(0, width), rng.uniform(0, height)
        long_px, thin_px, angle = rng.uniform(40, 90), rng.uniform(3, 8), rng.uniform(0, np.pi)
        grey = texture(seed + 100 + k, 10.0, rng.uniform(60, 190))
        covers = _leaf(centre, long_px, thin_px, angle)
        surfaces.append(Surface(plane(float(slope)), grey, covers))
    return Still("thin leaves", layout, tuple(surfaces), seed)


def _leaf(centre: tuple[float, float], long_px: float, thin_px: float, angle: float) -> Covers:
    """An ellipse by its half axes."""
    c, s = np.cos(angle), np.sin(angle)

    def covers(u: Array, v: Array) -> NDArray[np.bool_]:
        x, y = u - centre[0], v - centre[1]
        return ((c * x + s * y) / long_px) ** 2 + ((c * y - s * x) / thin_px) ** 2 < 1.0

    return covers


PANE_PX = 160, 80, 480, 320
PANE_SLOPES_PX = WALL_PX, 9.0
MIRROR_SLOPES_PX = 4.0, 6.0


def pane(layout: Layout, seed: int) -> Still:
    """Half of the light comes through a window from the wall, half is reflected in it."""
    wall = _textured_wall(seed)
    reflected = Surface(plane(PANE_SLOPES_PX[1]), texture(seed + 1), box(*PANE_PX))
    return Still("glass pane", layout, (wall,), seed, reflected=(wall, reflected))


def mirror(layout: Layout, seed: int, *, curved: bool) -> Still:
    """What a mirror shows moves as if it lay behind its frame.

    A curved one shows rows and columns of views at different slopes.
    """
    left, top, right, bottom = PANE_PX

    def frame(u: Array, v: Array) -> NDArray[np.bool_]:
        return (u <= left) | (u >= right) | (v <= top) | (v >= bottom)

    def seen(slope_px: float) -> tuple[Surface, ...]:
        shown = Surface(plane(slope_px), texture(seed), everywhere)
        return shown, Surface(plane(FRONT_PX), texture(seed + 1), frame)

    row_px, column_px = MIRROR_SLOPES_PX
    if not curved:
        return Still("plane mirror", layout, seen(row_px), seed)
    return Still("curved mirror", layout, seen(row_px), seed, by_column=seen(column_px))


def too_far(seed: int) -> Still:
    """A dense light field with slopes of -1.5..1.4, of which only -0.5..0.5 are searched."""
    height, width = DENSE.shape
    layout = Layout(DENSE.x_steps, DENSE.y_steps, DENSE.shape, (-0.5, 0.5))
    wall = Surface(plane(-1.5, 2.2 / width, 0.3 / height), texture(seed), everywhere)
    front = Surface(plane(1.4), texture(seed + 1), box(40 + seed % 9, 60, 110, 190))
    return Still("range too small", layout, (wall, front), seed)


def slanted(seed: int, slant: float) -> Still:
    """A wall that runs away along the row, px of slope per px."""
    height, width = ROW_OF_9.shape
    reach_px = 0.5 * slant * width + 1.0
    layout = Layout(ROW_OF_9.x_steps, ROW_OF_9.y_steps, (height, width), (-reach_px, reach_px))
    wall = Surface(plane(-0.5 * slant * width, slant), texture(seed), everywhere)
    return Still(f"slant {slant:g} px per px", layout, (wall,), seed)
