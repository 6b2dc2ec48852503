"""The board in closed form: every ray meets a plane. Needs no renderer and is fast.

For unit tests and mass statistics; agrees with `rig_sim.render_mitsuba` within 0.01 px (tested).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError
from rig_sim.board import Board
from rig_sim.optics import TrueCamera
from rig_sim.scenes.catalogue import static_surfaces
from rig_sim.surface import Surface, cast
from rig_sim.window import Window
from rig_sim.world import Moment

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

_EDGE_SAMPLES = 64
_LATTICE_STEP = 41
"""Near the golden section of the samples, and prime to their number."""
_BENCHES_KEPT = 16


class AnalyticRenderer:
    """Draws the board before its bench.

    Raises:
        ConfigError: asked for another scene than `board`.
    """

    name = "analytic"

    def render(self, moment: Moment) -> tuple[Picture, ...]:
        """Return noise-free, unblurred light of all views, (H, W) each, 1 = full scale."""
        board = moment.board
        if board is None:
            raise ConfigError(
                f"the analytic renderer draws scene board only, asked for {moment.scene}",
                advice='set world.renderer = "mitsuba"',
            )
        return tuple(_draw(camera, board) for camera in moment.cameras)


def _draw(camera: TrueCamera, board: Board) -> Picture:
    picture = _bench(camera).copy()
    window = Window.of_board(camera, board)
    if window.is_empty:
        return picture
    # One pixel more on every side gives the derivatives at the window's own border.
    x_px, y_px = np.meshgrid(
        np.arange(window.x0 - 1, window.x1 + 1, dtype=np.float64),
        np.arange(window.y0 - 1, window.y1 + 1, dtype=np.float64),
    )
    cover, light = _sampled(*_on_board(camera, board, x_px, y_px), board)
    picture[window.pixels] *= 1.0 - cover
    picture[window.pixels] += light
    return picture


def _on_board(camera: TrueCamera, board: Board, x_px: Array, y_px: Array) -> tuple[Array, Array]:
    """Return where rays meet the board: x and y in texels from the first square's corner."""
    to_board = board.rotation.T
    start = to_board @ (np.asarray(camera.position_mm) - np.asarray(board.centre_mm))
    along = camera.directions(x_px, y_px) @ (to_board @ camera.rotation).T
    distance = -start[2] / along[..., 2]
    texels = board.texels.shape[::-1]
    x, y = (
        (start[axis] + distance * along[..., axis]) / board.texel_mm + texels[axis] / 2.0
        for axis in (0, 1)
    )
    return x, y


def _sampled(x: Array, y: Array, board: Board) -> tuple[Picture, Picture]:
    """Average the board over every pixel: share covered, and light times that share."""
    inner = (slice(1, -1), slice(1, -1))
    cover, light = _look(x[inner], y[inner], board)
    x_slope, y_slope = _half_steps(x), _half_steps(y)
    # Only a pixel whose footprint crosses an edge needs more than its middle.
    rows, columns = board.texels.shape
    mixed = _crosses(x[inner], x_slope, columns, board) | _crosses(y[inner], y_slope, rows, board)
    across, down = _places_in_pixels(int(mixed.sum()))
    fine_x, fine_y = (
        place[inner][mixed].astype(np.float32)[:, None]
        + slope[0][mixed].astype(np.float32)[:, None] * across
        + slope[1][mixed].astype(np.float32)[:, None] * down
        for place, slope in ((x, x_slope), (y, y_slope))
    )
    fine_cover, fine_light = _look(fine_x, fine_y, board)
    cover[mixed], light[mixed] = fine_cover.mean(axis=-1), fine_light.mean(axis=-1)
    return cover, light


def _half_steps(place: Array) -> tuple[Array, Array]:
    """Change of a place over half a pixel to the right and down."""
    return (
        (place[1:-1, 2:] - place[1:-1, :-2]) / 4.0,
        (place[2:, 1:-1] - place[:-2, 1:-1]) / 4.0,
    )


def _crosses(
    place: Array, slope: tuple[Array, Array], texels: int, board: Board
) -> NDArray[np.bool_]:
    """Whether a pixel holds a line between texels, or an end of the paper, along one axis."""
    reach = np.abs(slope[0]) + np.abs(slope[1])
    margin = board.margin_mm / board.texel_mm
    to_line = np.abs(place - np.rint(place))
    to_end = np.abs(np.abs(place - texels / 2.0) - (texels / 2.0 + margin))
    return np.minimum(to_line, to_end) <= reach


def _look(
    x: NDArray[np.floating], y: NDArray[np.floating], board: Board
) -> tuple[Picture, Picture]:
    """Cover (0 or 1) and light at exact places, in texels from the first square's corner."""
    rows, columns = board.texels.shape
    margin = board.margin_mm / board.texel_mm
    ring = np.pad(board.texels, 1, constant_values=board.margin_light)
    column = np.clip(np.floor(x), -1, columns).astype(np.int32)
    row = np.clip(np.floor(y), -1, rows).astype(np.int32)
    cover = (x >= -margin) & (x <= columns + margin) & (y >= -margin) & (y <= rows + margin)
    light = ring[row + 1, column + 1] * cover
    return cover.astype(np.float32), light


def _places_in_pixels(count: int) -> tuple[Picture, Picture]:
    """Places across and down inside pixels, -1 to 1, each (count, samples).

    A rank-1 lattice, shifted at random in every pixel: without the shift an edge along the pixel
    grid would be off by the same fraction of a sample everywhere. Source: R. Cranley and
    T. N. L. Patterson, "Randomization of number theoretic methods for multiple integration",
    SIAM J. Numer. Anal. 13 (1976).
    """
    number = np.arange(_EDGE_SAMPLES, dtype=np.float32)
    shifts = np.random.Generator(np.random.SFC64(1)).random((2, count, 1), dtype=np.float32)
    across, down = (
        (number * step / _EDGE_SAMPLES + shift) % np.float32(1.0) * 2.0 - 1.0
        for step, shift in zip((1, _LATTICE_STEP), shifts, strict=True)
    )
    return across, down


@lru_cache(maxsize=_BENCHES_KEPT)
def _bench(camera: TrueCamera) -> Picture:
    """The picture without a board; its soft surfaces need but the middle of every pixel."""
    directions = camera.directions(*camera.pixel_grid()) @ camera.rotation.T
    surfaces = static_surfaces("board")
    return seen(surfaces, np.asarray(camera.position_mm), directions).astype(np.float32)


def seen(surfaces: tuple[Surface, ...], origin_mm: Array, directions: Array) -> Array:
    """Return the light (...) along rays from (3,) or (..., 3), directions (..., 3)."""
    origin_mm = np.broadcast_to(origin_mm, directions.shape)
    distance, index = cast([surface.shape for surface in surfaces], origin_mm, directions)
    light = np.zeros(distance.shape)
    for number, surface in enumerate(surfaces):
        here = index == number
        points = origin_mm[here] + distance[here][:, None] * directions[here]
        unit_from_world = surface.shape.unit_from_world
        unit = points @ unit_from_world[:2, :3].T + unit_from_world[:2, 3]
        light[here] = _texel(surface.texture, (unit + 1.0) / 2.0)
    return light


def _texel(texture: Picture, uv: Array) -> Array:
    """Linear interpolation between texel centres; the border continues."""
    rows, columns = texture.shape
    x = np.clip(uv[:, 0] * columns - 0.5, 0.0, columns - 1.0)
    y = np.clip(uv[:, 1] * rows - 0.5, 0.0, rows - 1.0)
    left = np.minimum(x.astype(int), columns - 2)
    top = np.minimum(y.astype(int), rows - 2)
    dx, dy = x - left, y - top
    upper = texture[top, left] * (1.0 - dx) + texture[top, left + 1] * dx
    lower = texture[top + 1, left] * (1.0 - dx) + texture[top + 1, left + 1] * dx
    return upper * (1.0 - dy) + lower * dy
