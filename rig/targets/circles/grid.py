"""An asymmetric grid of circles: every other row is shifted by half a step.

Layout and numbering as in OpenCV's calibration sample: circle `row * columns + column` stands at
x = (2 column + row mod 2) spacing, y = row spacing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError


@dataclass(frozen=True, slots=True)
class CircleGrid:
    """Black circles on white in rows that are shifted in turn; its points are their centres."""

    columns: int
    """Circles in a row."""
    rows: int
    spacing_mm: float
    """From row to row: half the distance of two circles in a row."""
    diameter_mm: float

    def __post_init__(self) -> None:
        if self.columns < 2 or self.rows < 3:
            raise ConfigError(
                f"grid of {self} circles asked for", advice="use one of at least 2 x 3"
            )
        nearest_mm = np.sqrt(2.0) * self.spacing_mm
        if not 0 < self.diameter_mm < nearest_mm < np.inf:
            raise ConfigError(
                f"circles of {self.diameter_mm:g} mm in rows {self.spacing_mm:g} mm apart asked "
                f"for, their centres are {nearest_mm:.3g} mm apart",
                advice="spacing_mm is from row to row, half the distance of two circles in a row; "
                "circles do not touch",
            )

    @property
    def has_one_way_up(self) -> bool:
        """With an even number of rows the grid looks the same after half a turn."""
        return self.rows % 2 == 1

    @property
    def places(self) -> NDArray[np.intp]:
        """(rows, columns, 2) places (right, down) of the circles in spacings."""
        row, column = np.indices((self.rows, self.columns))
        return np.stack([2 * column + row % 2, row], axis=-1)

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Centres (rows, columns, 3), mm, from the first one; z 0."""
        flat = self.places * self.spacing_mm
        points = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=-1)
        return np.asarray(points, np.float64)

    @property
    def gap_mm(self) -> float:
        """White between two circles."""
        return float(np.sqrt(2.0)) * self.spacing_mm - self.diameter_mm

    def __str__(self) -> str:
        return f"{self.columns} x {self.rows}"
