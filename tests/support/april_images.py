"""Pictures of an AprilGrid as Kalibr prints it: OpenCV draws the tags, projection carries them.

Shares no code with `rig` or `sim`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

_UNIT = 20
"""Texels along a bit's side."""
_FINE = 6
"""Samples along a pixel's side: the edges of texels are not softened before they are looked up."""


@dataclass(frozen=True)
class AprilScene:
    """A grid of tags before one camera at the origin, z forward."""

    tag_columns: int = 4
    tag_rows: int = 3
    tag_mm: float = 30.0
    spacing: float = 0.3
    border_bits: int = 2
    first_tag: int = 0
    squares: bool = True
    """Whether small squares touch the corners of the tags."""
    distance_mm: float = 500.0
    """Of the grid's middle, along z."""
    offset_mm: tuple[float, float] = (0.0, 0.0)
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation vector of the grid about its middle."""
    width: int = 640
    height: int = 400
    focal_px: float = 700.0
    blur_px: float = 0.8
    black: float = 40.0
    white: float = 190.0
    background: float = 110.0

    def with_changes(self, **changes: object) -> "AprilScene":
        return replace(self, **changes)  # pyright: ignore[reportArgumentType]

    @property
    def size_tags(self) -> tuple[float, float]:
        """Width and height of the grid, without the outer squares, in sides of a tag."""
        step = 1 + self.spacing
        return self.tag_columns * step - self.spacing, self.tag_rows * step - self.spacing

    def corners(self) -> Float:
        """(2 tag_rows, 2 tag_columns, 2) px, top left corner first."""
        step = 1 + self.spacing
        right = np.array([c * step + side for c in range(self.tag_columns) for side in (0, 1)])
        down = np.array([r * step + side for r in range(self.tag_rows) for side in (0, 1)])
        x, y = np.meshgrid(right, down)
        points = np.stack([x, y, np.ones_like(x)], axis=-1)
        shown = points @ self.pixel_from_tags().T
        return np.asarray(shown[..., :2] / shown[..., 2:], np.float64)

    def pixel_from_tags(self) -> Float:
        """Homography from sides of a tag, right of and below the top left corner, to px."""
        tilt_rad = np.radians(np.array(self.tilt_deg, np.float64))
        rotation = np.asarray(cv2.Rodrigues(tilt_rad)[0], np.float64)
        wide, high = self.size_tags
        across, down = rotation[:, 0] * self.tag_mm, rotation[:, 1] * self.tag_mm
        origin = np.array([*self.offset_mm, self.distance_mm]) - wide / 2 * across - high / 2 * down
        middle = (self.width - 1) / 2, (self.height - 1) / 2
        camera = np.array(
            [[self.focal_px, 0, middle[0]], [0, self.focal_px, middle[1]], [0, 0, 1.0]]
        )
        return np.asarray(camera @ np.column_stack([across, down, origin]), np.float64)

    def texture(self) -> tuple[NDArray[np.uint8], int, int]:
        """The grid on paper, texels per side of a tag, and texels of margin around it."""
        bits = 6 + 2 * self.border_bits
        side = _UNIT * bits
        gap = round(self.spacing * side)
        assert gap == self.spacing * side
        wide, high = (round(n * side) for n in self.size_tags)
        margin = 2 * gap
        paper = np.full((high + 2 * margin, wide + 2 * margin), 255, np.uint8)
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        for row in range(self.tag_rows):
            for column in range(self.tag_columns):
                # Kalibr counts from the bottom left; its tags are OpenCV's half a turn around.
                number = self.first_tag + (self.tag_rows - 1 - row) * self.tag_columns + column
                marker = cv2.aruco.generateImageMarker(
                    dictionary, number, side, borderBits=self.border_bits
                )
                top, left = (margin + n * (side + gap) for n in (row, column))
                paper[top : top + side, left : left + side] = np.rot90(marker, 2)
                for y in (top - gap, top + side) if self.squares else ():
                    for x in (left - gap, left + side):
                        paper[y : y + gap, x : x + gap] = 0
        return paper, side, margin

    def clean(self) -> NDArray[np.float32]:
        """(height, width) picture without noise, in grey levels."""
        texture, side, margin = self.texture()
        scale = 1 / side
        tags_from_texel = np.array(
            [
                [scale, 0, (0.5 - margin) * scale],
                [0, scale, (0.5 - margin) * scale],
                [0, 0, 1],
            ]
        )
        fine_from_pixel = np.array(
            [[_FINE, 0, (_FINE - 1) / 2], [0, _FINE, (_FINE - 1) / 2], [0, 0, 1]]
        )
        carry = fine_from_pixel @ self.pixel_from_tags() @ tags_from_texel
        grey = self.black + (self.white - self.black) / 255 * texture.astype(np.float32)
        size = (self.width * _FINE, self.height * _FINE)
        paper = cv2.warpPerspective(grey, carry, size, flags=cv2.INTER_LINEAR)
        cover = cv2.warpPerspective(np.ones_like(grey), carry, size, flags=cv2.INTER_LINEAR)
        sharp = np.asarray(self.background * (1 - cover) + paper, np.float32)
        sigma = self.blur_px * _FINE
        smooth = cv2.GaussianBlur(sharp, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
        fine = smooth.reshape(self.height, _FINE, self.width, _FINE)
        return np.asarray(fine.mean(axis=(1, 3)), np.float32)
