"""Pictures of a checkerboard through a lens of any width, in closed form: r = f * angle.

Shares no code with `rig` or `sim`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from tests.support.board_images import SUPERSAMPLING, blurred


@dataclass(frozen=True)
class WideBoard:
    """A board before an equidistant lens; the camera looks along z, the board lies off its axis."""

    columns: int = 9
    rows: int = 6
    square_mm: float = 25.0
    distance_mm: float = 300.0
    """From the camera to the board's middle."""
    off_axis_deg: tuple[float, float] = (0.0, 0.0)
    """Angle from the axis to the board's middle, and towards which side of the picture."""
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation vector of the board about its middle, from facing the camera."""
    width: int = 640
    height: int = 480
    across_deg: float = 170.0
    """Field of view across the width."""
    blur_px: float = 0.7

    @property
    def focal_px(self) -> float:
        """Pixels per radian."""
        return self.width / float(np.radians(self.across_deg))

    def corners(self) -> Float:
        """True inner corners (rows, columns, 2), px."""
        row, column = np.mgrid[: self.rows, : self.columns].astype(np.float64)
        return self._shown(np.stack([column, row], axis=-1))

    def border(self) -> Float:
        """The outline of the outer squares (N, 2), px."""
        along = np.linspace(-1.0, 1.0, 20)
        half = np.array([self.columns + 1, self.rows + 1]) / 2
        middle = np.array([self.columns - 1, self.rows - 1]) / 2
        sides = [np.stack([along, np.full(20, end)], axis=1) for end in (-1.0, 1.0)]
        sides += [side[:, ::-1] for side in sides]
        return self._shown(middle + half * np.concatenate(sides))

    def clean(self) -> NDArray[np.float32]:
        """(height, width) picture without noise, in grey levels."""
        fine = SUPERSAMPLING
        x = (np.arange(self.width * fine) + 0.5) / fine - 0.5 - (self.width - 1) / 2
        y = ((np.arange(self.height * fine) + 0.5) / fine - 0.5 - (self.height - 1) / 2)[:, None]
        radius = np.hypot(x, y)
        angle = radius / self.focal_px
        aside = np.sin(angle) / np.maximum(radius, 1e-9)
        ray = np.stack([x * aside, y * aside, np.cos(angle)], axis=-1)
        across, down, origin = self._board()
        normal = np.cross(across, down)
        depth = (origin @ normal) / (ray @ normal)
        point = ray * depth[..., None] - origin
        column, row = point @ across / self.square_mm**2, point @ down / self.square_mm**2
        grey = np.where((np.floor(column) + np.floor(row)) % 2 == 0, 40.0, 190.0)
        grey[_outside(column, row, self.columns, self.rows, 1.0)] = 190.0
        grey[_outside(column, row, self.columns, self.rows, 1.6) | (depth < 0)] = 110.0
        return blurred(grey.astype(np.float32), self.blur_px)

    def _board(self) -> tuple[Float, Float, Float]:
        """One square along columns and rows, and inner corner (0, 0), mm in the camera's frame."""
        angle, side = np.radians(self.off_axis_deg)
        turn = cv2.Rodrigues(np.array([-np.sin(side), np.cos(side), 0.0]) * angle)[0]
        tilt = cv2.Rodrigues(np.radians(np.array(self.tilt_deg)))[0]
        across, down = (turn @ tilt[:, axis] * self.square_mm for axis in (0, 1))
        middle = turn @ np.array([0.0, 0.0, self.distance_mm])
        origin = middle - (self.columns - 1) / 2 * across - (self.rows - 1) / 2 * down
        return across, down, origin

    def _shown(self, places: Float) -> Float:
        across, down, origin = self._board()
        point = places[..., :1] * across + places[..., 1:] * down + origin
        aside = np.hypot(point[..., 0], point[..., 1])
        radius = self.focal_px * np.arctan2(aside, point[..., 2]) / np.maximum(aside, 1e-9)
        middle = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        return middle + point[..., :2] * radius[..., None]


def _outside(
    column: Float, row: Float, columns: int, rows: int, margin: float
) -> NDArray[np.bool_]:
    x, y = np.abs(column - (columns - 1) / 2), np.abs(row - (rows - 1) / 2)
    return (x > (columns - 1) / 2 + margin) | (y > (rows - 1) / 2 + margin)
