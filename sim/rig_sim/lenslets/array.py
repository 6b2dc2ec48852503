"""The true lenslet array of a simulated camera: its cells, its micro-images, its vignetting.

Shares nothing with `rig.lenslet`: a mistake must not cancel itself out.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_EDGE_PX = 1.0
"""Width over which an aperture darkens: a pixel lies across its edge."""


@dataclass(frozen=True)
class TrueArray:
    """A regular array of lenslets before a sensor.

    The micro-image of the lenslet at `p` lies at `p (1 + g/B)` on the sensor, as the light comes
    from the main lens at the distance B of the array, g before the sensor: so the pixel at `q`
    belongs to the lenslet nearest to `q / (1 + g/B)`. All lengths are those of the sensor's pixels.
    """

    lattice: Literal["hexagonal", "square"]
    width_px: int
    """Of the raw picture."""
    height_px: int
    spacing_px: float
    """Between neighbouring micro-images on the sensor."""
    rotation_rad: float = 0.0
    """Of the array, from the rows of the sensor towards its columns."""
    offset_px: tuple[float, float] = (0.0, 0.0)
    """Of one micro-image from the middle of the raw picture."""
    g_over_b: float = 0.0
    """From the lenslets to the sensor, over that from the main lens to the lenslets."""
    distortion: float = 0.0
    """A centre at the half diagonal lies farther out by this part."""
    aperture_px: float = 7.0
    """Radius of the main lens's stop, as a micro-image shows it."""
    barrel_px: float = math.inf
    """Radius of the stop that cuts the light of the outer lenslets: the cat's eye."""
    barrel_shift: float = 0.0
    """By how much that stop seems to move, over the distance of the lenslet from the middle."""
    falloff: float = 0.0
    """Light lost at the half diagonal, beside the cat's eye."""
    missing: frozenset[tuple[int, int]] = frozenset()
    """Lenslets that give no light."""

    @property
    def middle_px(self) -> Array:
        """Where the optical axis meets the sensor, (2,)."""
        return np.array([self.width_px - 1, self.height_px - 1]) / 2.0

    @property
    def half_diagonal_px(self) -> float:
        """From the middle to a corner."""
        return float(np.linalg.norm(self.middle_px))

    @cached_property
    def _basis(self) -> Array:
        """Columns: from a lenslet to the next in its row, and to the next row; on the array."""
        turn = np.array(
            [
                [math.cos(self.rotation_rad), -math.sin(self.rotation_rad)],
                [math.sin(self.rotation_rad), math.cos(self.rotation_rad)],
            ]
        )
        rows = {"hexagonal": (0.5, math.sqrt(0.75)), "square": (0.0, 1.0)}[self.lattice]
        return turn @ np.array([[1.0, rows[0]], [0.0, rows[1]]]) * self.lens_spacing_px

    @property
    def lens_spacing_px(self) -> float:
        """Between neighbouring lenslets themselves."""
        return self.spacing_px / (1.0 + self.g_over_b)

    def lenslets_px(self, i: Index | Array, j: Index | Array) -> Array:
        """Return places (..., 2) of lenslets on the array, from the axis."""
        offset_px = np.array(self.offset_px) / (1.0 + self.g_over_b)
        return np.stack([i, j], axis=-1) @ self._basis.T + offset_px

    def centres_px(self, i: Index | Array, j: Index | Array) -> Array:
        """Return true centres (..., 2) of micro-images in the raw picture."""
        away = self.lenslets_px(i, j) * (1.0 + self.g_over_b)
        return self.middle_px + away * (1.0 + self.distortion * self._square(away))[..., None]

    def cells(self, x_px: Array, y_px: Array) -> tuple[Index, Index]:
        """Return the lenslets whose light falls on places of the raw picture."""
        away = np.stack([x_px, y_px], axis=-1) - self.middle_px
        straight = away
        for _ in range(8 if self.distortion else 0):
            straight = away / (1.0 + self.distortion * self._square(straight))[..., None]
        on_array = straight / (1.0 + self.g_over_b)
        number = (on_array - self.lenslets_px(np.array(0), np.array(0))) @ np.linalg.inv(
            self._basis
        ).T
        best_i = best_j = np.zeros(x_px.shape, np.int64)
        best = np.full(x_px.shape, np.inf)
        for down in (0, 1):
            j = np.floor(number[..., 1]).astype(np.int64) + down
            # In a row of a hexagonal array the number that fits best shifts with the row.
            shift = 0.5 if self.lattice == "hexagonal" else 0.0
            i = np.rint(number[..., 0] + shift * (number[..., 1] - j)).astype(np.int64)
            distance = np.linalg.norm(on_array - self.lenslets_px(i, j), axis=-1)
            nearer = distance < best
            best_i, best_j = np.where(nearer, i, best_i), np.where(nearer, j, best_j)
            best = np.where(nearer, distance, best)
        return best_i, best_j

    def passed(self, x_px: Array, y_px: Array, i: Index, j: Index) -> Array:
        """Return which part of the light reaches places of the raw picture through lenslets."""
        centre = self.centres_px(i, j)
        dx, dy = x_px - centre[..., 0], y_px - centre[..., 1]
        light = _disk(np.hypot(dx, dy), self.aperture_px)
        away = centre - self.middle_px
        if math.isfinite(self.barrel_px):
            shift = self.barrel_shift * away
            light = light * _disk(np.hypot(dx - shift[..., 0], dy - shift[..., 1]), self.barrel_px)
        light = light / (1.0 + self.falloff * self._square(away))
        if self.missing:
            gone = np.array(sorted(self.missing))
            code = np.isin(i * 100_000 + j, gone[:, 0] * 100_000 + gone[:, 1])
            light = np.where(code, 0.0, light)
        return light

    def _square(self, away: Array) -> Array:
        return np.sum(away * away, axis=-1) / self.half_diagonal_px**2

    def pixels(self) -> tuple[Array, Array]:
        """Return columns and rows of all pixel centres, each (H, W)."""
        x, y = np.meshgrid(
            np.arange(self.width_px, dtype=np.float64), np.arange(self.height_px, dtype=np.float64)
        )
        return x, y

    def white(self) -> Array:
        """Return the light (H, W) of an evenly lit white surface, 1 = all of it."""
        x, y = self.pixels()
        return self.passed(x, y, *self.cells(x, y))


def _disk(radius_px: Array, edge_px: float) -> Array:
    """Share of a pixel inside a disk, its edge taken as straight."""
    return np.clip(0.5 + (edge_px - radius_px) / _EDGE_PX, 0.0, 1.0)
