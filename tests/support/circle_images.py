"""Pictures of an asymmetric grid of circles in closed form: ray meets plane, inside or not.

Shares no code with `rig` or `sim`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

_FINE = 3


@dataclass(frozen=True)
class CircleScene:
    """Black circles on white paper before one pinhole at the origin, z forward."""

    columns: int = 4
    rows: int = 7
    spacing_mm: float = 20.0
    diameter_mm: float = 18.0
    distance_mm: float = 500.0
    """Of the grid's middle, along z."""
    offset_mm: tuple[float, float] = (0.0, 0.0)
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    width: int = 480
    height: int = 320
    focal_px: float = 600.0
    blur_px: float = 0.8
    black: float = 40.0
    white: float = 190.0
    background: float = 110.0
    shading: float = 0.0
    """Share by which light falls from the left border to the right one."""

    def with_changes(self, **changes: object) -> "CircleScene":
        return replace(self, **changes)  # pyright: ignore[reportArgumentType]

    def pixel_from_board(self) -> Float:
        """Homography from millimetres right of and below circle 0 to px."""
        rotation = cv2.Rodrigues(np.radians(np.array(self.tilt_deg, np.float64)))[0]
        middle = self.spacing_mm * np.array([self.columns - 0.5, (self.rows - 1) / 2])
        origin = np.array([*self.offset_mm, self.distance_mm]) - rotation[:, :2] @ middle
        camera = np.array(
            [
                [self.focal_px, 0, (self.width - 1) / 2],
                [0, self.focal_px, (self.height - 1) / 2],
                [0, 0, 1.0],
            ]
        )
        return np.asarray(
            camera @ np.column_stack([rotation[:, 0], rotation[:, 1], origin]), np.float64
        )

    def board_mm(self) -> Float:
        """(rows * columns, 2) centres, row by row."""
        places = [
            ((2 * column + row % 2) * self.spacing_mm, row * self.spacing_mm)
            for row in range(self.rows)
            for column in range(self.columns)
        ]
        return np.array(places)

    def centres(self) -> Float:
        """(rows * columns, 2) px where the centres appear."""
        shown = np.column_stack([self.board_mm(), np.ones(self.rows * self.columns)])
        shown = shown @ self.pixel_from_board().T
        return shown[:, :2] / shown[:, 2:]

    def middles(self) -> Float:
        """(rows * columns, 2) px of the middles of the ellipses, by the dual conic."""
        homography = self.pixel_from_board()
        found: list[Float] = []
        for x, y in self.board_mm():
            r2 = (self.diameter_mm / 2) ** 2
            # The dual conic of a circle; its picture is H D H', its middle the last column.
            dual = np.array([[x * x - r2, x * y, x], [x * y, y * y - r2, y], [x, y, 1.0]])
            shown = homography @ dual @ homography.T
            found.append(shown[:2, 2] / shown[2, 2])
        return np.array(found)

    def clean(self) -> NDArray[np.float32]:
        """(height, width) picture without noise, in grey levels."""
        x = (np.arange(self.width * _FINE) + 0.5) / _FINE - 0.5
        y = ((np.arange(self.height * _FINE) + 0.5) / _FINE - 0.5)[:, None]
        (a, b, c), (d, e, f), (g, h, i) = np.linalg.inv(self.pixel_from_board())
        depth = g * x + h * y + i
        right = (a * x + b * y + c) / depth / self.spacing_mm
        down = (d * x + e * y + f) / depth / self.spacing_mm
        row = np.clip(np.round(down), 0, self.rows - 1)
        ink = np.zeros(depth.shape, np.bool_)
        radius = self.diameter_mm / 2 / self.spacing_mm
        for near in (row - 1, row, row + 1):
            shift = np.mod(near, 2)
            column = np.clip(np.round((right - shift) / 2), 0, self.columns - 1)
            inside = (near >= 0) & (near < self.rows)
            ink |= inside & (np.hypot(right - 2 * column - shift, down - near) < radius)
        paper = (right > -1.5) & (right < 2 * self.columns + 0.5)
        paper &= (down > -1.5) & (down < self.rows + 0.5)
        grey = np.where(paper, np.where(ink, self.black, self.white), self.background)
        grey = grey * (1 - self.shading * (x / self.width - 0.5))
        smooth = cv2.GaussianBlur(
            grey.astype(np.float32), (0, 0), self.blur_px * _FINE, borderType=cv2.BORDER_REPLICATE
        )
        fine = smooth.reshape(self.height, _FINE, self.width, _FINE)
        return np.asarray(fine.mean(axis=(1, 3)), np.float32)
