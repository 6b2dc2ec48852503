"""The checkerboard that the stage carries."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Checkerboard:
    """A checkerboard, counted by its inner corners.

    A board of `columns x rows` inner corners has one square more each way. With one number odd
    and the other even the colours tell which end is up; otherwise the board looks the same after
    half a turn.
    """

    columns: int
    rows: int
    square_mm: float

    def __post_init__(self) -> None:
        if self.columns < 3 or self.rows < 3:
            raise ConfigError(
                f"board of {self.columns} x {self.rows} inner corners asked for",
                advice="use one with at least 3 x 3",
            )
        if not (np.isfinite(self.square_mm) and self.square_mm > 0):
            raise ConfigError(
                f"squares of {self.square_mm} mm asked for", advice="give their side in mm"
            )

    @property
    def has_one_way_up(self) -> bool:
        """Whether the colours of the squares fix the orientation."""
        return (self.columns + self.rows) % 2 == 1

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Inner corners on the board (rows, columns, 3), mm; x along columns, y along rows, z 0."""
        row, column = np.mgrid[0 : self.rows, 0 : self.columns].astype(np.float64)
        return np.stack([column, row, np.zeros_like(row)], axis=-1) * self.square_mm

    def __str__(self) -> str:
        return f"{self.columns} x {self.rows}"
