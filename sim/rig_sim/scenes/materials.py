"""What things on a desk are made of: reflectance textures (rows, columns) with fine detail.

Every one has structure down to its own texels, as real materials have under a close look. Calling
a material gives a recipe: nothing is computed before the recipe is called in its turn.
"""

from collections.abc import Callable
from functools import partial, wraps
from typing import ParamSpec

import numpy as np
from numpy.typing import NDArray

from rig_sim.textures import Texture, fractal

Grid = NDArray[np.float64]
Recipe = Callable[[], Texture]
Choices = ParamSpec("Choices")


def recipe(material: Callable[Choices, Texture]) -> Callable[Choices, Recipe]:
    """Put off the work of a material."""

    @wraps(material)
    def chosen(*args: Choices.args, **kwargs: Choices.kwargs) -> Recipe:
        return partial(material, *args, **kwargs)

    return chosen


@recipe
def plain(size: tuple[int, int], seed: int, *, level: float, grain: float = 0.03) -> Texture:
    """Cardboard, stoneware, soil: a level with natural unevenness."""
    return _ink(level + grain * fractal(size, seed, fall=0.8))


@recipe
def wallpaper(size: tuple[int, int], seed: int, *, period: int) -> Texture:
    """A repeating ornament on rough paper, worn differently everywhere."""
    y, x = _grid(size, 2.0 * np.pi / period)
    ornament = np.cos(x + 1.3 * np.sin(y)) * np.cos(y + 0.8 * np.sin(2.0 * x))
    stripe = np.tanh(4.0 * np.cos(x / 3.0))
    wear = fractal(size, seed, fall=1.0)
    rough = fractal(size, seed + 1, fall=0.4)
    return _ink(0.46 + 0.06 * ornament + 0.02 * stripe + 0.03 * wear + 0.035 * rough)


@recipe
def wood(size: tuple[int, int], seed: int, *, boards: int, level: float = 0.42) -> Texture:
    """Boards running left to right: year rings, fibres, and a dark joint between boards."""
    rows = size[0]
    y, _ = _grid(size, 1.0)
    warp = fractal(size, seed, fall=1.8)
    board = np.floor(y * boards / rows)
    offset = np.random.default_rng(seed).uniform(0.0, 40.0, boards)[board.astype(int)]
    rings = np.sin((y / rows * 55.0 + offset) * (1.0 + 0.05 * offset) + 4.0 * warp)
    fibres = _stretched(size, seed + 1, across=24)
    specks = fractal(size, seed + 2, fall=0.3)
    joint = np.minimum((y * boards / rows) % 1.0, 1.0 - (y * boards / rows) % 1.0)
    shade = 0.02 * np.sin(offset) - 0.22 * np.exp(-(joint * rows / boards / 1.5))
    return _ink(level + 0.035 * rings + 0.055 * fibres + 0.025 * specks + shade)


@recipe
def print_page(size: tuple[int, int], seed: int, *, line: int, picture: float = 0.35) -> Texture:
    """A printed page: a headline, a picture in the upper part, lines of words below."""
    rows, columns = size
    random = np.random.default_rng(seed)
    page = 0.66 + 0.015 * fractal(size, seed, fall=0.4)
    edge = columns // 12
    split = int(rows * picture)
    _write(page, random, top=line, bottom=3 * line, edge=edge, line=2 * line)
    if split > 6 * line:
        image = photograph((split - 5 * line, columns - 2 * edge), seed + 1)()
        page[4 * line : split - line, edge : columns - edge] = image
    _write(page, random, top=max(split, 4 * line), bottom=rows - line, edge=edge, line=line)
    return _ink(page)


@recipe
def photograph(size: tuple[int, int], seed: int) -> Texture:
    """Something that has the statistics of a natural picture: patches, gradients and edges."""
    coarse, fine = fractal(size, seed, fall=1.5), fractal(size, seed + 1, fall=0.7)
    patches = np.tanh(3.0 * coarse) + 0.5 * np.tanh(6.0 * fractal(size, seed + 2, fall=1.3))
    return _ink(0.40 + 0.13 * patches + 0.07 * fine)


@recipe
def map_sheet(size: tuple[int, int], seed: int) -> Texture:
    """A globe's map: continents, coast lines, a graticule and small print."""
    rows, columns = size
    y, x = _grid(size, 1.0)
    height = fractal(size, seed, fall=1.7)
    land = np.tanh(9.0 * (height - 0.3))
    coast = np.exp(-((height - 0.3) ** 2) / 0.002)
    lines = np.minimum((y * 12 / rows) % 1.0 * rows / 12, (x * 24 / columns) % 1.0 * columns / 24)
    names = (fractal(size, seed + 1, fall=0.2) > 2.0) & (land > 0.0)
    relief = 0.05 * fractal(size, seed + 2, fall=0.8)
    return _ink(0.45 + 0.12 * land - 0.2 * coast - 0.12 * (lines < 1.0) - 0.2 * names + relief)


@recipe
def glaze(size: tuple[int, int], seed: int) -> Texture:
    """A potter's glaze: bands with running edges, and speckles."""
    y, _ = _grid(size, 1.0)
    running = 0.04 * fractal(size, seed, fall=1.4)
    bands = np.tanh(8.0 * np.sin(2.0 * np.pi * (2.5 * y / size[0] + running)))
    specks = fractal(size, seed + 1, fall=0.25) > 1.8
    return _ink(0.50 + 0.12 * bands - 0.22 * specks + 0.04 * fractal(size, seed + 2, fall=0.8))


@recipe
def leaf(size: tuple[int, int], seed: int) -> Texture:
    """A leaf in polar texture coordinates (columns: radius, rows: angle): veins and mottle."""
    rows, columns = size
    angle, radius = _grid(size, 1.0)
    angle, radius = angle * 2.0 * np.pi / rows, radius / columns
    along, aside = radius * np.cos(angle), np.abs(radius * np.sin(angle))
    midrib = np.exp(-((aside / 0.03) ** 2))
    veins = np.cos(2.0 * np.pi * (5.0 * along - 4.0 * aside)) > 0.93
    mottle = 0.05 * fractal(size, seed, fall=0.7)
    return _ink(0.34 + 0.16 * midrib + 0.10 * veins + mottle)


@recipe
def lacquer(size: tuple[int, int], seed: int, *, level: float, stripes: int) -> Texture:
    """Pencils and poles: faces around (columns), scratches and a stamp along (rows)."""
    rows, columns = size
    y, x = _grid(size, 1.0)
    faces = np.cos(2.0 * np.pi * stripes * x / columns)
    stamp = (fractal((rows, 1), seed, fall=0.2) > 0.8) & (y < 0.4 * rows)
    scratches = fractal(size, seed + 1, fall=0.5)
    return _ink(level + 0.05 * faces - 0.12 * stamp + 0.06 * scratches)


def _write(
    page: Texture, random: np.random.Generator, *, top: int, bottom: int, edge: int, line: int
) -> None:
    """Fill lines with words of dark and light strokes."""
    columns = page.shape[1]
    for y in range(top, bottom - line, line):
        x = edge
        while x < columns - edge:
            word = int(random.integers(2, 9)) * max(2, line // 2)
            end = min(x + word, columns - edge)
            strokes = random.uniform(0.0, 0.6, (max(1, line * 3 // 5), end - x))
            page[y : y + strokes.shape[0], x:end] -= (strokes > 0.25) * strokes
            x = end + max(2, line // 2)


def _stretched(size: tuple[int, int], seed: int, *, across: int) -> Texture:
    """Noise drawn out along the rows."""
    rows, columns = size
    short = fractal((rows, max(2, columns // across)), seed, fall=0.5)
    places = np.linspace(0.0, short.shape[1] - 1.0, columns)
    left = np.minimum(places.astype(int), short.shape[1] - 2)
    share = (places - left).astype(np.float32)
    return short[:, left] * (1.0 - share) + short[:, left + 1] * share


def _grid(size: tuple[int, int], scale: float) -> tuple[Grid, Grid]:
    y, x = np.indices(size, np.float64)
    return y * scale, x * scale


def _ink(reflectance: NDArray[np.floating]) -> Texture:
    """Keep to what paper and ink can reflect."""
    return np.clip(reflectance, 0.05, 0.85).astype(np.float32)
