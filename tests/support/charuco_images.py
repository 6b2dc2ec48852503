"""Pictures of a ChArUco board: OpenCV draws the board, closed-form projection carries it.

Shares no code with `rig` or `sim`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.support.board_images import SUPERSAMPLING, BoardScene

_BITS_ACROSS = 6
_MARGIN = 0.5


@dataclass(frozen=True)
class CharucoScene(BoardScene):
    """A ChArUco board of `columns + 1` x `rows + 1` squares.

    Markers of 4 x 4 bits only: others do not fall on the drawing's pixels.
    """

    columns: int = 6
    rows: int = 4
    dictionary: int = cv2.aruco.DICT_4X4_50
    inverted: bool = False
    legacy_pattern: bool = False
    marker_share: float = 0.75
    """Side of a marker over the side of a square."""

    @property
    def units(self) -> int:
        """Parts of a square's side of which margin and bits are whole numbers."""
        share = Fraction(self.marker_share).limit_denominator(100)
        return lcm(((1 - share) / 2).denominator, (share / _BITS_ACROSS).denominator)

    def texture(self) -> NDArray[np.uint8]:
        """The board with its margin, about one texel per sub-pixel; 255 is paper."""
        side_px = self.focal_px * self.square_mm / self.distance_mm * SUPERSAMPLING
        square = self.units * max(2, round(side_px / self.units))
        size = (self.columns + 1, self.rows + 1)
        dictionary = cv2.aruco.getPredefinedDictionary(self.dictionary)
        board = cv2.aruco.CharucoBoard(size, 1.0, self.marker_share, dictionary)
        board.setLegacyPattern(self.legacy_pattern)
        drawn = board.generateImage((size[0] * square, size[1] * square))
        margin = int(_MARGIN * square)
        paper = cv2.copyMakeBorder(
            drawn, margin, margin, margin, margin, cv2.BORDER_CONSTANT, value=255
        )
        return np.asarray(255 - paper if self.inverted else paper, np.uint8)

    def sharp(self, x_step: float = 0.0, y_step: float = 0.0) -> NDArray[np.float32]:
        """See `BoardScene.sharp`."""
        fine = SUPERSAMPLING
        across = (np.arange(self.width * fine) + 0.5) / fine - 0.5
        down = ((np.arange(self.height * fine) + 0.5) / fine - 0.5)[:, None]
        picture = np.empty((self.height * fine, self.width * fine), np.float32)
        picture[:] = self._background(across, down, x_step, y_step)
        texture = self.texture()
        squares = (self.rows + 1 + 2 * _MARGIN, self.columns + 1 + 2 * _MARGIN)
        per_square = texture.shape[0] / squares[0]
        # Texel centres to squares from the first inner corner.
        shift = 0.5 / per_square - _MARGIN - 1
        board_from_texel = np.array(
            [[1 / per_square, 0, shift], [0, 1 / per_square, shift], [0, 0, 1]]
        )
        fine_from_pixel = np.array(
            [[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]]
        )
        carry = fine_from_pixel @ self.pixel_from_board(x_step, y_step) @ board_from_texel
        grey = self.black + (self.white - self.black) / 255 * texture.astype(np.float32)
        size = (picture.shape[1], picture.shape[0])
        paper = cv2.warpPerspective(grey, carry, size, flags=cv2.INTER_LINEAR)
        cover = cv2.warpPerspective(np.ones_like(grey), carry, size, flags=cv2.INTER_LINEAR)
        return np.asarray(picture * (1 - cover) + paper, np.float32)
