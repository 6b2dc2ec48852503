"""Flat drawings through any lens, by cheap arithmetic: ray meets plane, texel, blur, noise.

Shares no code with `rig` or `sim`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Image = NDArray[np.uint8]

_FINE = 2
"""Samples across a pixel; the drawings are smoothed by a texel before."""


@dataclass(frozen=True)
class Lens:
    """A camera of `r = f tan(k angle) / k`: a fisheye for small k, a pinhole for k = 1."""

    width: int
    height: int
    across_deg: float
    """Field of view across the width."""
    k: float

    @property
    def focal_px(self) -> float:
        """Radius over angle, on the axis."""
        half = float(np.radians(self.across_deg)) / 2
        return self.width / 2 * self.k / float(np.tan(self.k * half))

    @property
    def middle_px(self) -> Float:
        """Where the axis meets the picture."""
        return np.array([(self.width - 1) / 2, (self.height - 1) / 2])

    def rays(self) -> NDArray[np.float32]:
        """(rows, columns, 3) unit rays of the sub-pixels."""
        x = ((np.arange(self.width * _FINE) + 0.5) / _FINE - 0.5 - self.middle_px[0])[None]
        y = ((np.arange(self.height * _FINE) + 0.5) / _FINE - 0.5 - self.middle_px[1])[:, None]
        x, y = x.astype(np.float32), y.astype(np.float32)
        radius = np.sqrt(x * x + y * y)
        angle = np.arctan(radius * np.float32(self.k / self.focal_px)) / np.float32(self.k)
        aside = np.sin(angle) / np.maximum(radius, np.float32(1e-6))
        return np.stack([x * aside, y * aside, np.cos(angle)], axis=-1)

    def shown(self, points: Float) -> Float:
        """Pixels (..., 2) of points (..., 3); NaN where this lens does not reach."""
        aside = np.hypot(points[..., 0], points[..., 1])
        angle = np.arctan2(aside, points[..., 2])
        turned = self.k * angle
        reach = np.where(turned < 1.5, np.tan(np.minimum(turned, 1.5)), np.nan)
        radius = self.focal_px / self.k * reach / np.maximum(aside, 1e-12)
        return self.middle_px + points[..., :2] * radius[..., None]


@dataclass(frozen=True)
class Plane:
    """Where a drawing hangs: its unit is one square; (0, 0) is its middle."""

    across: Float
    down: Float
    middle: Float

    def points(self, places: Float) -> Float:
        """Points (..., 3) of places (..., 2) of the drawing."""
        return self.middle + places[..., :1] * self.across + places[..., 1:] * self.down


def hung(
    towards_deg: tuple[float, float], tilt_deg: tuple[float, float, float], distance: float
) -> Plane:
    """A plane at an angle from the axis, towards one side, turned about its own middle."""
    angle, side = np.radians(towards_deg)
    turn = cv2.Rodrigues(np.array([-np.sin(side), np.cos(side), 0.0]) * angle)[0]
    tilt = cv2.Rodrigues(np.radians(np.array(tilt_deg)))[0]
    turn = turn @ tilt
    aim = cv2.Rodrigues(np.array([-np.sin(side), np.cos(side), 0.0]) * angle)[0]
    return Plane(turn[:, 0], turn[:, 1], aim @ np.array([0.0, 0.0, distance]))


@dataclass(frozen=True)
class Drawing:
    """Grey levels on a plane; NaN-free, and nothing beyond its border."""

    grey: Image
    per_unit: float
    """Texels in one square."""


def looked_at(
    lens: Lens,
    behind: NDArray[np.float32],
    rays: NDArray[np.float32],
    *hangings: tuple[Drawing, Plane],
) -> NDArray[np.float32]:
    """The sub-pixels of a picture: drawings on planes before what is behind, later ones in front.

    Args:
        lens: the camera.
        behind: (H, W) grey levels where nothing hangs.
        rays: of the lens.
        hangings: pairs of drawing and plane.
    """
    size = (lens.width * _FINE, lens.height * _FINE)
    fine = np.asarray(cv2.resize(behind, size, interpolation=cv2.INTER_LINEAR), np.float32)
    for drawing, plane in hangings:
        _hang(fine, rays, drawing, plane)
    return fine


def _hang(
    fine: NDArray[np.float32], rays: NDArray[np.float32], drawing: Drawing, plane: Plane
) -> None:
    frame = np.stack([plane.across, plane.down, plane.middle], axis=1)
    seen = rays @ np.linalg.inv(frame).T.astype(np.float32)
    front = seen[..., 2] > 1e-4
    depth = np.where(front, seen[..., 2], np.float32(1))
    rows, columns = drawing.grey.shape
    x = seen[..., 0] / depth * np.float32(drawing.per_unit) + np.float32((columns - 1) / 2)
    y = seen[..., 1] / depth * np.float32(drawing.per_unit) + np.float32((rows - 1) / 2)
    inside = front & (x > -0.5) & (x < columns - 0.5) & (y > -0.5) & (y < rows - 0.5)
    if not inside.any():
        return
    top, left = np.argmax(inside.any(axis=1)), np.argmax(inside.any(axis=0))
    below = len(inside) - np.argmax(inside.any(axis=1)[::-1])
    right = inside.shape[1] - np.argmax(inside.any(axis=0)[::-1])
    part = (slice(top, below), slice(left, right))
    grey = cv2.remap(
        drawing.grey.astype(np.float32), x[part], y[part], cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    fine[part] = np.where(inside[part], grey, fine[part])


def taken(
    fine: NDArray[np.float32], blur_px: float, noise: float, random: np.random.Generator
) -> Image:
    """The picture of 8 bits: blurred, integrated over pixels, with noise."""
    smooth = cv2.GaussianBlur(fine, (0, 0), max(blur_px * _FINE, 0.3))
    rows, columns = smooth.shape
    grey = smooth.reshape(rows // _FINE, _FINE, columns // _FINE, _FINE).mean(axis=(1, 3))
    grey = grey + noise * random.standard_normal(grey.shape, np.float32)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)
