"""A checkerboard whose white squares hold markers: every corner has a name of its own.

Layout as in OpenCV: S. Garrido-Jurado et al., "Automatic generation and detection of highly
reliable fiducial markers under occlusion", Pattern Recognition 47(6), 2014, for the markers; marker
numbers grow along the rows of the board from its first white square.
"""

from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.errors import ConfigError
from rig.targets.checkerboard import Checkerboard

DICTIONARIES: dict[str, int] = {
    name.removeprefix("DICT_"): number
    for name, number in sorted(vars(cv2.aruco).items())
    if name.startswith("DICT_") and name.upper() == name
}
"""OpenCV's predefined dictionaries by name, such as `4X4_50`."""


@dataclass(frozen=True, slots=True)
class CharucoBoard:
    """A ChArUco board, counted by its squares; its points are the inner corners."""

    squares_across: int
    squares_down: int
    square_mm: float
    marker_mm: float
    """Side of a marker with its border."""
    dictionary: str
    """Name in `DICTIONARIES`; `DICT_` before it is allowed."""
    inverted: bool = False
    """Printed white on black: every grey level turned round."""
    legacy_pattern: bool = False
    """With an even number of rows the first square is white, as in OpenCV before 4.6."""

    def __post_init__(self) -> None:
        if min(self.squares_across, self.squares_down) < 3 or self.columns * self.rows < 6:
            raise ConfigError(
                f"ChArUco board of {self} squares asked for", advice="use one with at least 4 x 3"
            )
        if not 0 < self.marker_mm < self.square_mm < np.inf:
            raise ConfigError(
                f"markers of {self.marker_mm:g} mm in squares of {self.square_mm:g} mm asked for",
                advice="both are positive, and markers are smaller than squares",
            )
        object.__setattr__(self, "dictionary", self.dictionary.upper().removeprefix("DICT_"))
        if self.dictionary not in DICTIONARIES:
            raise ConfigError(
                f"dictionary {self.dictionary} asked for",
                advice=f"known are {', '.join(DICTIONARIES)}",
            )
        holds = len(_all_bits(self.dictionary))
        if self.marker_count > holds:
            raise ConfigError(
                f"ChArUco board of {self} squares needs {self.marker_count} markers, "
                f"{self.dictionary} holds {holds}",
                advice="use a larger dictionary or fewer squares",
            )

    @property
    def columns(self) -> int:
        """Inner corners in a row."""
        return self.squares_across - 1

    @property
    def rows(self) -> int:
        """Inner corners in a column."""
        return self.squares_down - 1

    @property
    def has_one_way_up(self) -> bool:
        """Markers tell which end is up."""
        return True

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Inner corners (rows, columns, 3), mm, from the first one; z 0."""
        row, column = np.mgrid[0 : self.rows, 0 : self.columns].astype(np.float64)
        return np.stack([column, row, np.zeros_like(row)], axis=-1) * self.square_mm

    @property
    def as_checkerboard(self) -> Checkerboard:
        """The same inner corners without the markers.

        Raises:
            ConfigError: a checkerboard needs 3 x 3 inner corners.
        """
        return Checkerboard(self.columns, self.rows, self.square_mm)

    @property
    def first_is_white(self) -> bool:
        """Whether the top left square holds a marker."""
        return self.legacy_pattern and self.squares_down % 2 == 0

    @property
    def white(self) -> NDArray[np.bool_]:
        """(squares_down, squares_across) which squares hold a marker."""
        row, column = np.indices((self.squares_down, self.squares_across))
        return (row + column) % 2 == (0 if self.first_is_white else 1)

    @property
    def marker_numbers(self) -> NDArray[np.intp]:
        """(squares_down, squares_across) number of each square's marker, -1 for none."""
        white = self.white
        return np.where(white, np.cumsum(white).reshape(white.shape) - 1, -1)

    @property
    def marker_count(self) -> int:
        """How many markers there are."""
        return self.squares_across * self.squares_down // 2 + (
            self.squares_across * self.squares_down % 2 if self.first_is_white else 0
        )

    @property
    def marker_share(self) -> float:
        """Side of a marker over the side of a square."""
        return self.marker_mm / self.square_mm

    @property
    def marker_bits(self) -> NDArray[np.bool_]:
        """(markers, n, n) inner bits, True for white, before any inversion."""
        return _all_bits(self.dictionary)[: self.marker_count]

    @property
    def bits_across(self) -> int:
        """Bits of a marker from edge to edge, with its border of one bit."""
        return _all_bits(self.dictionary).shape[1] + 2

    def with_changes(self, **changes: object) -> "CharucoBoard":
        """Return the same board in other respects."""
        return replace(self, **changes)  # pyright: ignore[reportArgumentType]

    def __str__(self) -> str:
        return f"{self.squares_across} x {self.squares_down}"


def dictionary_bits(name: str) -> NDArray[np.bool_]:
    """(markers, n, n) inner bits of all markers of a dictionary, True for white."""
    return _all_bits(name)


@cache
def _all_bits(name: str) -> NDArray[np.bool_]:
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[name])
    codes, side = dictionary.bytesList, dictionary.markerSize
    read = cv2.aruco.Dictionary.getBitsFromByteList
    bits = np.stack([read(codes[i : i + 1], side) for i in range(len(codes))]).astype(np.bool_)
    bits.flags.writeable = False
    return bits
