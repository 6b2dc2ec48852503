"""A grid of AprilTags with small squares between their corners, as Kalibr prints it.

Layout: Kalibr's target of type `aprilgrid` (J. Maye, P. Furgale, R. Siegwart, "Self-supervised
calibration for robotic systems", IEEE Intelligent Vehicles Symposium, 2013, and its wiki); tags:
E. Olson, "AprilTag: a robust and flexible visual fiducial system", ICRA 2011. At every corner of a
tag a small black square touches it, so that the corner is a crossing of two edges.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError
from rig.targets.charuco.board import dictionary_bits

DICTIONARY = "APRILTAG_36H11"
BITS = 6
"""Inner bits across a tag."""


@dataclass(frozen=True, slots=True)
class AprilGrid:
    """An AprilGrid, counted by its tags; its points are the four corners of every tag.

    Rows of points count from the top, as everywhere here; numbers of tags from the bottom left and
    upwards, as in Kalibr.
    """

    tag_columns: int
    """Kalibr's tagCols."""
    tag_rows: int
    """Kalibr's tagRows."""
    tag_mm: float
    """Kalibr's tagSize: side of a tag with its black border."""
    spacing: float
    """Kalibr's tagSpacing: gap between tags over the side of a tag."""
    border_bits: int = 2
    """Width of the black border; Kalibr prints 2, other programs 1."""
    first_tag: int = 0
    """Number of the tag at the bottom left."""

    def __post_init__(self) -> None:
        if min(self.tag_columns, self.tag_rows) < 1 or self.tag_columns * self.tag_rows < 2:
            raise ConfigError(
                f"AprilGrid of {self} tags asked for", advice="use one with at least two tags"
            )
        if not (0 < self.tag_mm < np.inf and 0 < self.spacing <= 1):
            raise ConfigError(
                f"tags of {self.tag_mm:g} mm, {self.spacing:g} of that apart, asked for",
                advice="give their side in mm, and the gap as a share of it, such as 0.3",
            )
        if self.border_bits not in (1, 2):
            raise ConfigError(
                f"tags with a border of {self.border_bits} bits asked for",
                advice="Kalibr prints 2, other programs 1",
            )
        holds = len(dictionary_bits(DICTIONARY))
        if self.first_tag < 0 or self.first_tag + self.tag_count > holds:
            raise ConfigError(
                f"AprilGrid of {self} tags from number {self.first_tag} on asked for, the family "
                f"36h11 has the numbers 0..{holds - 1}",
                advice="use fewer tags, or begin lower",
            )

    @property
    def tag_count(self) -> int:
        """How many tags there are."""
        return self.tag_columns * self.tag_rows

    @property
    def columns(self) -> int:
        """Points in a row."""
        return 2 * self.tag_columns

    @property
    def rows(self) -> int:
        """Points in a column."""
        return 2 * self.tag_rows

    @property
    def has_one_way_up(self) -> bool:
        """Tags tell which end is up."""
        return True

    @property
    def places(self) -> NDArray[np.float64]:
        """(rows, columns, 2) places (right, down) of the points in sides of a tag."""
        down, right = (_along(count, self.spacing) for count in (self.tag_rows, self.tag_columns))
        return np.stack(np.meshgrid(right, down), axis=-1)

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Corners of all tags (rows, columns, 3), mm, from the top left one; z 0."""
        places = self.places * self.tag_mm
        return np.concatenate([places, np.zeros((*places.shape[:2], 1))], axis=-1)

    @property
    def tag_numbers(self) -> NDArray[np.intp]:
        """(tag_rows, tag_columns) numbers of the tags, top row first."""
        count = np.arange(self.tag_count, dtype=np.intp).reshape(self.tag_rows, self.tag_columns)
        return count[::-1] + self.first_tag

    @property
    def bits_across(self) -> int:
        """Bits of a tag from edge to edge, with its border."""
        return BITS + 2 * self.border_bits

    @property
    def clear_share(self) -> float:
        """Distance from a corner to the next edge beside its own two, in sides of a tag."""
        return min(self.spacing, self.border_bits / self.bits_across)

    def __str__(self) -> str:
        return f"{self.tag_columns} x {self.tag_rows}"


def tag_bits() -> NDArray[np.bool_]:
    """(tags, 6, 6) inner bits of the whole family, True for white, upright as Kalibr prints them.

    OpenCV's own are those half a turn around.
    """
    return np.rot90(dictionary_bits(DICTIONARY), 2, axes=(1, 2))


def _along(count: int, spacing: float) -> NDArray[np.float64]:
    begins = np.arange(count) * (1.0 + spacing)
    return np.asarray(np.stack([begins, begins + 1.0], axis=1).ravel(), np.float64)
