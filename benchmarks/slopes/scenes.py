"""Scenes with exact slopes, drawn from a seed: dense light fields and sparse arrays."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.stored import stored
from rig.epipolar import RectifiedViews
from tests.support.lightfield import (
    Field,
    Surface,
    box,
    bump,
    disc,
    everywhere,
    expose,
    expose_to_light,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

Array = NDArray[np.float64]
Covers = Callable[[Array, Array], NDArray[np.bool_]]


WIDE_RANGE_PX = 10.0
"""Ranges of slopes above this are those of sparse arrays and pairs."""


@dataclass(frozen=True)
class Layout:
    """Where the views stand, and what one step is worth."""

    x_steps: Array
    y_steps: Array
    shape: tuple[int, int]
    range_px: tuple[float, float]


@dataclass(frozen=True)
class Scene:
    """Frames to estimate from and the slopes behind them."""

    name: str
    views: RectifiedViews
    slope_px: Array
    range_px: tuple[float, float]
    border_px: int
    noise_levels: float = 0.0
    """Noise that was added to the frames, grey levels, 1 sigma."""
    clean: NDArray[np.float32] | None = None
    """(V, H, W) the views before noise, where they are known; else the frames are the best."""
    gain_spread: float = 0.0
    """Spread of the gains of the views in the frames, which the clean views do not have."""
    half: str = "-"
    """C: defaults were chosen on it; R: they are only reported on it; -: neither."""

    @property
    def is_dense(self) -> bool:
        """Whether errors are judged in hundredths of a px, as in a dense light field."""
        return self.range_px[1] - self.range_px[0] <= WIDE_RANGE_PX


def cross(arm: int) -> tuple[Array, Array]:
    """Row and column of a light field that share their middle view, the reference first."""
    along = np.array([k for k in range(-arm, arm + 1) if k], float)
    zeros = np.zeros_like(along)
    return np.concatenate([[0.0], along, zeros]), np.concatenate([[0.0], zeros, along])


DENSE = Layout(*cross(4), (256, 256), (-2.2, 2.2))
SPARSE = Layout(
    np.array([0, -1.04, 0.97, 0, 0.0]), np.array([0, 0, 0, -0.98, 1.05]), (400, 640), (-20.0, 60.0)
)
ROW = Layout(np.array([0, -1.0, 1.0]), np.zeros(3), (400, 640), (-20.0, 60.0))
COLUMN = Layout(np.zeros(3), np.array([0, -1.0, 1.0]), (400, 640), (-20.0, 60.0))
SQUARE = Layout(np.array([0, 1.0, 0, 1.0]), np.array([0, 0, 1.0, 1.0]), (400, 640), (-20.0, 60.0))
_ARM_ONLY = slice(0, 9), np.r_[0, 9:17]
DENSE_ROW, DENSE_COLUMN = (
    Layout(DENSE.x_steps[arm], DENSE.y_steps[arm], DENSE.shape, DENSE.range_px) for arm in _ARM_ONLY
)
PAIR = Layout(np.array([0, 1.0]), np.zeros(2), (400, 640), (-20.0, 60.0))


def grid(arm: int) -> tuple[Array, Array]:
    """Rows and columns of a full array about its middle view, the reference first."""
    x, y = np.meshgrid(*[np.arange(-arm, arm + 1.0)] * 2)
    order = np.argsort(np.hypot(x, y).ravel(), kind="stable")
    return x.ravel()[order], y.ravel()[order]


GRID_3 = Layout(*grid(1), (400, 640), (-20.0, 60.0))
GRID_9 = Layout(*grid(4), DENSE.shape, DENSE.range_px)


@dataclass(frozen=True)
class Recipe:
    """One line of the benchmark."""

    name: str
    seed: int
    layout: Layout
    contrast: float = 28.0
    finest_px: float = 1.8
    noise: float = 2.0
    gain_spread: float = 0.02
    repeats: bool = False
    """A pattern with a period of 7 px over the texture."""
    frayed: bool = False
    """Edges that let a part of what is behind them through."""
    position_error: float = 0.0
    """Random error of the positions told to the estimator, view steps, 1 sigma."""
    electrons_per_level: float | None = None
    """Half of the scene lies in the shadow, and noise grows with light; `noise` is read noise."""


# The defaults of the estimator were chosen on the first list and are reported on the second.
CHOSEN_ON = (
    Recipe("dense rich", 0, DENSE),
    Recipe("dense rich, clean", 1, DENSE, noise=0.0),
    Recipe("dense weak texture", 2, DENSE, contrast=6.0, finest_px=2.5),
    Recipe("dense noise 8", 3, DENSE, noise=8.0),
    Recipe("dense repetitive", 8, DENSE, contrast=6.0, repeats=True),
    Recipe("dense frayed edges", 9, DENSE, frayed=True),
    Recipe("sparse rich", 4, SPARSE),
    Recipe("sparse noise 5", 5, SPARSE, noise=5.0),
    Recipe("sparse weak texture", 6, SPARSE, contrast=6.0, finest_px=2.5),
    Recipe("sparse positions 0.003 off", 7, SPARSE, position_error=0.003),
)
REPORTED_ON = (
    Recipe("dense rich", 10, DENSE),
    Recipe("dense rich, noise 1", 11, DENSE, noise=1.0),
    Recipe("dense rich, noise 3", 12, DENSE, noise=3.0),
    Recipe("dense weak texture", 13, DENSE, contrast=6.0, finest_px=2.5),
    Recipe("dense noise 8", 14, DENSE, noise=8.0),
    Recipe("dense weak, clean", 21, DENSE, contrast=6.0, finest_px=2.5, noise=0.0),
    Recipe("dense repetitive", 22, DENSE, contrast=6.0, repeats=True),
    Recipe("dense frayed edges", 23, DENSE, frayed=True),
    Recipe("sparse rich", 15, SPARSE),
    Recipe("sparse rich, other", 16, SPARSE),
    Recipe("sparse coarse texture", 17, SPARSE, finest_px=4.0),
    Recipe("sparse weak texture", 18, SPARSE, contrast=6.0, finest_px=2.5),
    Recipe("sparse noise 5", 19, SPARSE, noise=5.0),
    Recipe("sparse gains 5 %", 20, SPARSE, gain_spread=0.05),
    Recipe("sparse positions 0.003 off", 24, SPARSE, position_error=0.003),
)
LAYOUTS = (
    Recipe("dense row and column", 31, DENSE),
    Recipe("dense row", 31, DENSE_ROW),
    Recipe("dense column", 31, DENSE_COLUMN),
    Recipe("cross of five", 30, SPARSE),
    Recipe("row of three", 30, ROW),
    Recipe("column of three", 30, COLUMN),
    Recipe("2 x 2 array", 30, SQUARE),
    Recipe("3 x 3 array", 30, GRID_3),
    Recipe("9 x 9 views", 31, GRID_9),
    Recipe("pair", 30, PAIR),
)
SHADED = (
    Recipe("dense, 4 e/level", 10, DENSE, noise=0.7, electrons_per_level=4.0),
    Recipe("dense, 20 e/level", 10, DENSE, noise=1.0, electrons_per_level=20.0),
    Recipe("dense weak, 20 e/level", 13, DENSE, 6.0, 2.5, noise=1.0, electrons_per_level=20.0),
    Recipe("sparse, 4 e/level", 15, SPARSE, noise=0.7, electrons_per_level=4.0),
    Recipe("sparse, 20 e/level", 15, SPARSE, noise=1.0, electrons_per_level=20.0),
)


def make_scene(recipe: Recipe) -> Scene:
    """Render one recipe; the same recipe always gives the same frames."""
    layout = recipe.layout
    exact = exact_views(recipe).astype(np.float64)
    if recipe.electrons_per_level is None:
        frames = expose(exact, noise=recipe.noise, gain_spread=recipe.gain_spread, seed=recipe.seed)
    else:
        frames = expose_to_light(
            exact,
            read_noise_levels=recipe.noise,
            electrons_per_level=recipe.electrons_per_level,
            gain_spread=recipe.gain_spread,
            seed=recipe.seed,
        )
    rng = np.random.default_rng(recipe.seed + 1000)
    told = [
        steps
        + recipe.position_error * rng.standard_normal(len(steps)) * (np.arange(len(steps)) > 0)
        for steps in (layout.x_steps, layout.y_steps)
    ]
    return Scene(
        recipe.name,
        RectifiedViews(frames, told[0], told[1], 0),
        true_slope_px(list(surfaces_of(recipe)), layout.shape),
        layout.range_px,
        border_px=0,
        noise_levels=recipe.noise,
        clean=exact.astype(np.float32),
        gain_spread=recipe.gain_spread,
        half="C" if recipe in CHOSEN_ON else "R" if recipe in REPORTED_ON else "-",
    )


def exact_views(recipe: Recipe) -> NDArray[np.float32]:
    """All views (V, H, W) of a recipe without noise and with one gain, kept on disk."""
    layout = recipe.layout

    def render() -> Array:
        surfaces = list(surfaces_of(recipe))
        return render_views(surfaces, layout.shape, layout.x_steps, layout.y_steps, supersample=2)

    drawn = (recipe.seed, recipe.contrast, recipe.finest_px, recipe.repeats, recipe.frayed)
    lit = recipe.electrons_per_level is not None
    told = f"{drawn} {lit} {layout.x_steps.tolist()} {layout.y_steps.tolist()} {layout.shape}"
    own = (surfaces_of, _half_in_shadow, _repeated, _frayed)
    return stored(render, f"{told} {layout.range_px}", *own)


def surfaces_of(recipe: Recipe) -> Iterator[Surface]:
    """A tilted wall, boards, balls and bars before it, from far to near."""
    rng = np.random.default_rng(recipe.seed)
    height, width = recipe.layout.shape
    low, high = recipe.layout.range_px
    far, near = low + 0.08 * (high - low), low + 0.9 * (high - low)
    tilt = 0.1 * (high - low) / width

    def texture(index: int) -> Field:
        random = noise_texture(
            100 * recipe.seed + index,
            mean=rng.uniform(90, 165),
            contrast=recipe.contrast,
            finest_px=recipe.finest_px,
        )
        if recipe.electrons_per_level is not None:
            return _half_in_shadow(random, 0.5 * width)
        return _repeated(random) if recipe.repeats else random

    def edge(covers: Covers) -> Covers:
        return _frayed(covers) if recipe.frayed else covers

    yield Surface(plane(far, abs(tilt), 0.3 * tilt), texture(0), everywhere)
    count = 8
    for k, share in enumerate(np.linspace(0.15, 0.95, count)):
        slope = far + share * (near - far)
        u, v = rng.uniform(0.1, 0.9) * width, rng.uniform(0.1, 0.9) * height
        size = rng.uniform(0.08, 0.22) * height
        match k % 4:
            case 0:
                a, b = rng.uniform(-tilt, tilt, 2)
                field = plane(slope - a * u - b * v, a, b)
                yield Surface(
                    field, texture(k + 1), edge(box(u - 1.5 * size, v - size, u + size, v + size))
                )
            case 1:
                top = slope + 0.1 * (high - low)
                yield Surface(
                    bump((u, v), size, slope, top), texture(k + 1), edge(disc((u, v), size))
                )
            case 2:
                bar = rng.uniform(2.5, 6.0)
                yield Surface(
                    plane(slope),
                    texture(k + 1),
                    edge(box(u - bar, v - 2 * size, u + bar, v + size)),
                )
            case _:
                yield Surface(plane(slope), texture(k + 1), edge(disc((u, v), 0.7 * size)))


def _half_in_shadow(lit: Field, edge_px: float) -> Field:
    """Light of 1.25 right of a place, 0.15 left of it, as painted on the surfaces."""
    return lambda u, v: lit(u, v) * (0.15 + 1.1 / (1.0 + np.exp(0.5 * (edge_px - u))))


def _repeated(random: Field) -> Field:
    """Waves of 7 px in both directions over a texture."""
    return lambda u, v: (
        random(u, v) + 14 * np.sin(2 * np.pi * u / 7) + 14 * np.sin(2 * np.pi * v / 7)
    )


def _frayed(covers: Covers) -> Covers:
    """Let holes of a fine random pattern into the outermost 1.5 px of a surface."""
    pattern = noise_texture(7, mean=0, contrast=1, finest_px=0.4, octaves=1)

    def holes(u: Array, v: Array) -> NDArray[np.bool_]:
        around = [covers(u + du, v + dv) for du, dv in ((1.5, 0), (-1.5, 0), (0, 1.5), (0, -1.5))]
        return covers(u, v) & (np.logical_and.reduce(around) | (pattern(u, v) > 0))

    return holes
