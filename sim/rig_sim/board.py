"""The board of a simulated rig: where it is and how bright it is."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import Vector
from rig_sim.optics import rotation_matrix
from rig_sim.surface import Shape

Array = NDArray[np.float64]

INK = 0.07
"""Light from a black square, 1 = full scale."""
PAPER = 0.72
"""Light from white squares and the margin."""


Print = tuple[str, ...]
"""Rows of texels, `#` ink and `.` paper: the same whole number of them along every square."""


@dataclass(frozen=True, slots=True)
class Board:
    """A flat board with a margin; its frame: x right, y down, origin in the middle."""

    columns: int
    """Inner corners per row."""
    rows: int
    """Inner corners per column."""
    square_mm: float
    margin_mm: float
    centre_mm: Vector
    """Of the board, in the world."""
    rotation_deg: Vector
    """Rodrigues vector of world_from_board."""
    print: Print = ()
    """What is printed inside the margin; empty: a plain checkerboard, first square black."""
    margin_light: float = PAPER
    """Light from the margin."""

    @property
    def rotation(self) -> Array:
        """Rotation part of world_from_board, (3, 3)."""
        return rotation_matrix(self.rotation_deg)

    @property
    def squares_across(self) -> tuple[int, int]:
        """How many squares there are in a row and in a column."""
        return self.columns + 1, self.rows + 1

    @property
    def half_size_mm(self) -> Array:
        """Half width and half height with the margin, (2,)."""
        return np.array(self.squares_across) * self.square_mm / 2.0 + self.margin_mm

    def in_world_mm(self, points_mm: Array) -> Array:
        """Carry points of the board (..., 2) into the world (..., 3)."""
        return points_mm @ self.rotation[:, :2].T + np.asarray(self.centre_mm)

    def shape(self) -> Shape:
        """Return the board with its margin as a rectangle."""
        half_width_mm, half_height_mm = self.half_size_mm
        world_from_unit = np.eye(4)
        world_from_unit[:3, :3] = self.rotation * (half_width_mm, half_height_mm, 1.0)
        world_from_unit[:3, 3] = self.centre_mm
        return Shape("rectangle", world_from_unit)

    def corners_mm(self) -> Array:
        """Return the inner corners row by row, (rows * columns, 2) in the board's frame."""
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        middle = np.array([self.columns - 1, self.rows - 1]) / 2.0
        return (np.stack([x.ravel(), y.ravel()], axis=-1) - middle) * self.square_mm

    def outline_mm(self, points_per_side: int) -> Array:
        """Return points along the outer edge of the margin, (4 * points_per_side, 2)."""
        run = np.linspace(-1.0, 1.0, points_per_side, endpoint=False)
        side = np.ones_like(run)
        around = [(run, -side), (side, run), (-run, side), (-side, -run)]
        unit = np.concatenate([np.stack(pair, axis=-1) for pair in around])
        return unit * self.half_size_mm

    @property
    def texels(self) -> NDArray[np.float32]:
        """Light of all texels without the margin, as many of them along every square."""
        return _texels(self.print or _checkerboard(*self.squares_across))

    @property
    def texel_mm(self) -> float:
        """Side of a texel."""
        return self.square_mm * self.squares_across[0] / self.texels.shape[1]


@lru_cache(maxsize=8)
def _checkerboard(across: int, down: int) -> Print:
    return tuple("".join(".#"[(row + x) % 2 == 0] for x in range(across)) for row in range(down))


@lru_cache(maxsize=8)
def _texels(rows: Print) -> NDArray[np.float32]:
    ink = np.array([list(row) for row in rows]) == "#"
    light = np.where(ink, np.float32(INK), np.float32(PAPER))
    light.flags.writeable = False
    return light
