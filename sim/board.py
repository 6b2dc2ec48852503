"""The checkerboard of a simulated rig: where it is and how bright it is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import Vector
from sim.optics import rotation_matrix
from sim.surface import Shape

Array = NDArray[np.float64]

INK = 0.07
"""Light from a black square, 1 = full scale."""
PAPER = 0.72
"""Light from white squares and the margin."""


@dataclass(frozen=True, slots=True)
class Board:
    """A flat checkerboard with a white margin; its frame: x right, y down, origin in the middle."""

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

    def squares(self) -> NDArray[np.float32]:
        """Return the light of all squares and of a ring of paper: (rows + 3, columns + 3)."""
        ring = np.full((self.rows + 3, self.columns + 3), PAPER, np.float32)
        row, column = np.indices((self.rows + 1, self.columns + 1))
        ring[1:-1, 1:-1] = np.where((row + column) % 2 == 0, INK, PAPER)
        return ring
