"""What a lenslet camera sees of a board and its bench, pixel by pixel, in closed form."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from rig.errors import ConfigError
from rig.profile import LensletWorldConfig, WorldConfig
from rig_sim.board import INK, PAPER, Board
from rig_sim.lenslets.array import Index, TrueArray
from rig_sim.lenslets.wall import Wall
from rig_sim.render_analytic import seen
from rig_sim.scenes.catalogue import static_surfaces

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

_COLUMN_STEP = {"hexagonal": math.sqrt(0.75), "square": 1.0}
"""A pixel of a view, in spacings of lenslets."""
_LENS_SIGMA = 0.25
"""Standard deviation of a place on the disk of a lenslet along one axis, in spacings."""
_COLOURS = np.array([[0.62, 1.0], [0.94, 0.55]])
"""Light behind the filters of a Bayer block that looks at white."""
_FINE = 16
"""Entries of a table per texel; between them it is linear."""


@dataclass(frozen=True, eq=False)
class RawLight:
    """Light on the sensor of the lenslet camera of a profile.

    A pixel's place in its micro-image says through which part of the main lens its light came, and
    its lenslet which place at the focus distance that light comes from: together one ray.
    """

    world: WorldConfig
    """Of the profile."""
    lenslets: LensletWorldConfig
    """Its array."""
    pitch_mm: float
    """One view step."""
    size_px: tuple[int, int]
    """Width and height of the raw picture."""

    @cached_property
    def array(self) -> TrueArray:
        """The array of the profile's world."""
        config = self.lenslets
        turned = math.radians(config.rotation_deg)
        generator = np.random.default_rng(self.world.seed)
        i, j = np.meshgrid(np.arange(-400, 400), np.arange(-400, 400))
        gone = generator.random(i.shape) < config.missing_share
        return TrueArray(
            lattice=config.lattice,
            width_px=self.size_px[0],
            height_px=self.size_px[1],
            spacing_px=config.spacing_px,
            rotation_rad=turned,
            offset_px=config.offset_px,
            g_over_b=config.g_over_b,
            distortion=config.distortion,
            aperture_px=config.aperture_px,
            barrel_px=config.barrel_px,
            barrel_shift=config.barrel_shift,
            falloff=config.falloff,
            missing=frozenset(zip(i[gone].tolist(), j[gone].tolist(), strict=True)),
        )

    def white(self) -> Picture:
        """Return the light (H, W) of a diffuser before the lens, 1 = full scale."""
        return (PAPER * self._passed).astype(np.float32)

    def of_board(self, board: Board) -> Picture:
        """Return the light (H, W) with a board before the bench, 1 = full scale.

        Raises:
            ConfigError: the board is no plain checkerboard.
        """
        if board.print:
            raise ConfigError(
                "a simulated lenslet camera draws plain checkerboards, the target is a ChArUco "
                "board",
                advice='set target.kind = "checkerboard"',
            )
        start, along = self._rays
        to_board = board.rotation.T
        begin = (start - np.asarray(board.centre_mm)) @ to_board.T
        move = along @ to_board.T
        distance = -begin[..., 2] / move[..., 2]
        sigma = self._sigma_mm(board.centre_mm[2]) / board.texel_mm
        covers, inks, signs = [], [], []
        margin = board.margin_mm / board.texel_mm
        for axis, count in ((0, board.squares_across[0]), (1, board.squares_across[1])):
            place = (begin[..., axis] + distance * move[..., axis]) / board.texel_mm + count / 2.0
            edges = np.arange(count + 1, dtype=np.float64)
            paper = np.array([-margin, count + margin])
            covers.append(_steps(place, paper, _BOX, sigma))
            inks.append(_steps(place, edges[[0, -1]], _BOX, sigma))
            signs.append(_steps(place, edges, _alternating(count), sigma))
        cover = covers[0] * covers[1]
        ink = (inks[0] * inks[1] + signs[0] * signs[1]) / 2.0
        light = cover * PAPER - ink * (PAPER - INK) + (1.0 - cover) * self._bench
        return (light * self._passed).astype(np.float32)

    def of_wall(self, wall: Wall) -> Picture:
        """Return the light (H, W) of a wall that fills the picture, 1 = full scale."""
        start, along = self._rays
        place = start + along * (wall.distance_mm / along[..., 2])[..., None]
        light = wall.light(place[..., 0], place[..., 1], self._sigma_mm(wall.distance_mm))
        return (PAPER * light * self._passed).astype(np.float32)

    @cached_property
    def _cells(self) -> tuple[Array, Array, Index, Index]:
        x, y = self.array.pixels()
        return x, y, *self.array.cells(x, y)

    @cached_property
    def _passed(self) -> Array:
        light = self.array.passed(*self._cells)
        if self.lenslets.is_bayer:
            rows, columns = light.shape
            light = light * np.tile(_COLOURS, (rows // 2 + 1, columns // 2 + 1))[:rows, :columns]
        return light

    @cached_property
    def _rays(self) -> tuple[Array, Array]:
        """Start (H, W, 3) in the plane of the main lens, and direction with z = 1."""
        x, y, i, j = self._cells
        array, optics = self.array, self.world.optics
        centre = array.centres_px(i, j)
        turn = np.array(
            [
                [math.cos(array.rotation_rad), -math.sin(array.rotation_rad)],
                [math.sin(array.rotation_rad), math.cos(array.rotation_rad)],
            ]
        )
        in_image = (np.stack([x, y], axis=-1) - centre) @ turn
        start_mm = in_image * self._mm_per_raw_px
        on_array = array.lenslets_px(i, j) @ turn / array.lens_spacing_px
        focus_mm = on_array * self._mm_per_spacing
        along = (focus_mm - start_mm) / optics.focus_mm
        depth = np.zeros(x.shape)
        return (
            np.concatenate([start_mm, depth[..., None]], axis=-1),
            np.concatenate([along, depth[..., None] + 1.0], axis=-1),
        )

    @cached_property
    def _bench(self) -> Array:
        """Light (H, W) without a board: that of the pixel's middle."""
        return seen(static_surfaces("board"), *self._rays)

    @property
    def _mm_per_raw_px(self) -> float:
        """On the main lens, per pixel of a micro-image."""
        return self.pitch_mm / self.lenslets.step_px

    @property
    def _mm_per_spacing(self) -> float:
        """At the focus distance, per lenslet."""
        optics = self.world.optics
        return optics.focus_mm / optics.focal_px / _COLUMN_STEP[self.lenslets.lattice]

    def _sigma_mm(self, depth_mm: float) -> float:
        """Of the blur of a pixel at a depth: lenslet, part of the main lens, point spread."""
        optics = self.world.optics
        magnified = depth_mm / optics.focus_mm
        lens_mm = _LENS_SIGMA * self._mm_per_spacing * magnified
        part_mm = self._mm_per_raw_px / math.sqrt(12.0) * abs(1.0 - magnified)
        spread_mm = optics.blur_px * depth_mm / optics.focal_px
        return math.sqrt(lens_mm**2 + part_mm**2 + spread_mm**2)


_BOX = np.array([1.0, -1.0])


def _alternating(count: int) -> Array:
    """Jumps of a function that is 1, -1, 1, ... over `count` squares and 0 outside, (count + 1)."""
    jumps = np.where(np.arange(count + 1) % 2 == 0, 2.0, -2.0)
    jumps[0], jumps[-1] = 1.0, 1.0 if count % 2 == 0 else -1.0
    return jumps.astype(np.float64)


def _steps(place: Array, edges: Array, jumps: Array, sigma: float) -> Array:
    """Sum of steps at edges, blurred by a Gaussian; from a table."""
    reach = 6.0 * sigma
    low, high = float(edges[0]) - reach, float(edges[-1]) + reach
    grid = np.linspace(low, high, math.ceil((high - low) * max(_FINE, 8.0 / sigma)) + 1)
    table = np.zeros(grid.shape)
    for edge, jump in zip(edges, jumps, strict=True):
        table += jump * ndtr((grid - edge) / sigma)
    return np.interp(place, grid, table).astype(np.float64)
