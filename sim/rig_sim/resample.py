"""Lens distortion for a renderer that knows pinholes only: render finer, then resample."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_sim.optics import TrueCamera, undistorted
from rig_sim.window import Window

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

FINER = 2
"""Pinhole pixels per picture pixel. Linear resampling then blurs by well under the lens."""


@dataclass(frozen=True, slots=True)
class Pinhole:
    """The part of an ideal pinhole picture that a renderer has to make."""

    width_px: int
    height_px: int
    focal_px: float
    centre_px: tuple[float, float]
    """Principal point; pixel centres at integers."""


class Lens:
    """Turns a pinhole picture into what one camera sees through its lens inside a window."""

    def __init__(self, camera: TrueCamera, window: Window) -> None:
        self._distorts = camera.distorts
        if not self._distorts:
            x, y = camera.centre_px
            self.pinhole = Pinhole(
                window.width, window.height, camera.focal_px, (x - window.x0, y - window.y0)
            )
            return
        # Four places in every pixel, a quarter pixel off its middle both ways.
        columns = np.arange(window.x0 * FINER, window.x1 * FINER) / FINER - (FINER - 1) / 2 / FINER
        rows = np.arange(window.y0 * FINER, window.y1 * FINER) / FINER - (FINER - 1) / 2 / FINER
        x, y = np.meshgrid(columns, rows)
        x, y = undistorted(
            (x - camera.centre_px[0]) / camera.focal_px,
            (y - camera.centre_px[1]) / camera.focal_px,
            camera.distortion,
        )
        focal_px = camera.focal_px * FINER
        x, y = x * focal_px, y * focal_px
        left, top = int(np.floor(x.min())) - 1, int(np.floor(y.min())) - 1
        width_px, height_px = int(np.ceil(x.max())) + 2 - left, int(np.ceil(y.max())) + 2 - top
        self.pinhole = Pinhole(width_px, height_px, focal_px, (-float(left), -float(top)))
        self._x, self._y = x - left, y - top

    def through(self, pinhole_picture: Picture) -> Picture:
        """Resample a picture (h, w, C) of `pinhole` to the window (H, W, C)."""
        if not self._distorts:
            return pinhole_picture
        fine = _linear(pinhole_picture, self._x, self._y)
        rows, columns, channels = fine.shape
        blocks = fine.reshape(rows // FINER, FINER, columns // FINER, FINER, channels)
        return blocks.mean(axis=(1, 3), dtype=np.float32)


def _linear(picture: Picture, x: Array, y: Array) -> Picture:
    """Sample (h, w, C) at exact places; OpenCV's remap would round them to 1/32 px."""
    left, top = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    dx = (x - left).astype(np.float32)[..., None]
    dy = (y - top).astype(np.float32)[..., None]
    upper = picture[top, left] * (1 - dx) + picture[top, left + 1] * dx
    lower = picture[top + 1, left] * (1 - dx) + picture[top + 1, left + 1] * dx
    return (upper * (1 - dy) + lower * dy).astype(np.float32, copy=False)
