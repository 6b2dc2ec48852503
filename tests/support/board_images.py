"""Pictures of a checkerboard in closed form: ray meets plane, pixel area, blur, noise.

Shares no code with `rig` or `sim`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

SUPERSAMPLING = 3


@dataclass(frozen=True)
class BoardScene:
    """A board before a camera array; the reference camera sits at the origin, z forward."""

    columns: int = 9
    rows: int = 6
    square_mm: float = 25.0
    distance_mm: float = 700.0
    """Of the board's centre, along z."""
    offset_mm: tuple[float, float] = (0.0, 0.0)
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation vector of the board about its centre."""
    width: int = 640
    height: int = 400
    focal_px: float = 560.0
    pitch_mm: float = 40.0
    focus_mm: float = 700.0
    blur_px: float = 0.9
    black: float = 40.0
    white: float = 190.0
    background: float = 110.0
    background_contrast: float = 0.0
    """Amplitude of a wavy background pattern at `background_mm`."""
    background_mm: float = 3000.0
    margin_squares: float = 0.6
    """Width of the white border around the outer squares."""

    def with_changes(self, **changes: object) -> "BoardScene":
        return replace(self, **changes)  # pyright: ignore[reportArgumentType]

    def pixel_from_board(self, x_step: float = 0.0, y_step: float = 0.0) -> Float:
        """Homography from board coordinates in squares (inner corner (0, 0) at 0) to px."""
        rotation = cv2.Rodrigues(np.radians(np.array(self.tilt_deg, np.float64)))[0]
        middle = np.array([(self.columns - 1) / 2, (self.rows - 1) / 2])
        across = rotation[:, 0] * self.square_mm
        down = rotation[:, 1] * self.square_mm
        centre = np.array([*self.offset_mm, self.distance_mm])
        origin = centre - middle[0] * across - middle[1] * down
        shift = np.array([x_step, y_step]) * self.pitch_mm
        origin[:2] -= shift
        principal = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        principal += shift * self.focal_px / self.focus_mm
        camera = np.array(
            [[self.focal_px, 0, principal[0]], [0, self.focal_px, principal[1]], [0, 0, 1.0]]
        )
        return np.asarray(camera @ np.column_stack([across, down, origin]), np.float64)

    def corners(self, x_step: float = 0.0, y_step: float = 0.0) -> Float:
        """True inner corners (rows, columns, 2), px."""
        row, column = np.mgrid[0 : self.rows, 0 : self.columns].astype(np.float64)
        points = np.stack([column, row, np.ones_like(row)], axis=-1)
        image = points @ self.pixel_from_board(x_step, y_step).T
        return image[..., :2] / image[..., 2:]

    def centre(self) -> Float:
        """Image of the board's centre in the reference view, px."""
        middle = np.array([(self.columns - 1) / 2, (self.rows - 1) / 2, 1.0])
        image = self.pixel_from_board() @ middle
        return image[:2] / image[2]

    def plane(self) -> Float:
        """Slope plane (a, b, c): m = a + b (u - u0) + c (v - v0) about `centre()`."""
        rotation = cv2.Rodrigues(np.radians(np.array(self.tilt_deg, np.float64)))[0]
        normal = rotation[:, 2]
        depth = normal @ np.array([*self.offset_mm, self.distance_mm])
        scale = self.focal_px * self.pitch_mm
        gradient = scale * normal[:2] / self.focal_px / depth
        slope = scale * (1 / self.distance_mm - 1 / self.focus_mm)
        return np.array([slope, *gradient])

    def clean(self, x_step: float = 0.0, y_step: float = 0.0) -> NDArray[np.float32]:
        """(height, width) picture without noise, in grey levels."""
        return blurred(self.sharp(x_step, y_step), self.blur_px)

    def sharp(self, x_step: float = 0.0, y_step: float = 0.0) -> NDArray[np.float32]:
        """The picture on the sub-pixel grid, before the lens blurs it."""
        fine = SUPERSAMPLING
        across = (np.arange(self.width * fine) + 0.5) / fine - 0.5
        down = ((np.arange(self.height * fine) + 0.5) / fine - 0.5)[:, None]
        picture = np.empty((self.height * fine, self.width * fine), np.float32)
        picture[:] = self._background(across, down, x_step, y_step)
        window = self._paper_window(x_step, y_step)
        picture[window] = self._paper(
            across[window[1]], down[window[0]], picture[window], x_step, y_step
        )
        return picture

    def _paper_window(self, x_step: float, y_step: float) -> tuple[slice, slice]:
        """Rows and columns of the sub-pixel grid that the paper may cover."""
        low = -1 - self.margin_squares
        x, y = np.meshgrid([low, self.columns - 1 - low], [low, self.rows - 1 - low])
        points = np.stack([x.ravel(), y.ravel(), np.ones(4)], axis=-1)
        image = points @ self.pixel_from_board(x_step, y_step).T
        image = (image[:, :2] / image[:, 2:] + 0.5) * SUPERSAMPLING
        limit = np.array([self.width, self.height]) * SUPERSAMPLING
        first = np.clip(np.floor(image.min(axis=0)) - 4, 0, limit).astype(int)
        last = np.clip(np.ceil(image.max(axis=0)) + 4, 0, limit).astype(int)
        return slice(first[1], last[1]), slice(first[0], last[0])

    def _paper(
        self,
        across: Float,
        down: Float,
        behind: NDArray[np.float32],
        x_step: float,
        y_step: float,
    ) -> Float:
        fine = SUPERSAMPLING
        board_from_pixel = np.linalg.inv(self.pixel_from_board(x_step, y_step))
        board_from_pixel /= np.abs(board_from_pixel).max()
        (h00, h01, h02), (h10, h11, h12), (h20, h21, h22) = board_from_pixel
        depth = h20 * across + h21 * down + h22
        x = (h00 * across + h01 * down + h02) / depth
        y = (h10 * across + h11 * down + h12) / depth
        per_x = np.hypot(h00 - x * h20, h01 - x * h21) / np.abs(depth) / fine
        per_y = np.hypot(h10 - y * h20, h11 - y * h21) / np.abs(depth) / fine
        # The square outside inner corner (0, 0) is black.
        pattern = _square_wave(x, per_x) * _square_wave(y, per_y)
        grey = (self.black + self.white) / 2 - (self.white - self.black) / 2 * pattern
        printed = _inside(x, per_x, self.columns, 0.0) * _inside(y, per_y, self.rows, 0.0)
        paper = _inside(x, per_x, self.columns, self.margin_squares)
        paper = paper * _inside(y, per_y, self.rows, self.margin_squares)
        grey = printed * grey + (1 - printed) * self.white
        return paper * grey + (1 - paper) * behind

    def _background(self, across: Float, down: Float, x_step: float, y_step: float) -> Float:
        if self.background_contrast == 0:
            return np.full((1, 1), self.background)
        slope = self.focal_px * self.pitch_mm * (1 / self.background_mm - 1 / self.focus_mm)
        u, v = across + slope * x_step, down + slope * y_step
        waves = (
            np.sin(0.31 * u + 0.07 * v)
            + np.sin(0.05 * u - 0.23 * v + 1.0)
            + np.sin(0.53 * u + 0.41 * v + 2.0)
        )
        return self.background + self.background_contrast / 3 * waves


def _square_wave(position: Float, per_sample: Float) -> Float:
    nearest = np.round(position)
    step = np.clip((position - nearest) / per_sample, -0.5, 0.5) * 2
    return step * (1 - 2 * (nearest % 2)) * -1


def _inside(position: Float, per_sample: Float, count: int, margin: float) -> Float:
    low = np.clip((position + 1 + margin) / per_sample, -0.5, 0.5) + 0.5
    high = np.clip((count + margin - position) / per_sample, -0.5, 0.5) + 0.5
    return low * high


def blurred(sharp: NDArray[np.float32], blur_px: float) -> NDArray[np.float32]:
    """Blur on the sub-pixel grid, then integrate over the pixel's area."""
    fine = SUPERSAMPLING
    sigma = blur_px * fine
    side = 2 * int(np.ceil(4.5 * sigma)) + 1
    smooth = cv2.GaussianBlur(sharp, (side, side), sigma, borderType=cv2.BORDER_REPLICATE)
    rows, columns = sharp.shape[0] // fine, sharp.shape[1] // fine
    return smooth.reshape(rows, fine, columns, fine).mean(axis=(1, 3), dtype=np.float32)


def digitised(
    clean: NDArray[np.float32], *, noise: float, rng: np.random.Generator, gain: float = 1.0
) -> NDArray[np.uint8]:
    """8-bit picture with white noise of `noise` grey levels."""
    noisy = clean * gain + noise * rng.standard_normal(clean.shape, np.float32)
    return np.clip(np.round(noisy), 0, 255).astype(np.uint8)
