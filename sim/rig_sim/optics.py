"""How the true cameras of a simulated rig see: pinhole, sensor shift, pose, lens distortion.

World frame: the nominal reference camera (x right, y down, z forward, mm). The few lines of
projective geometry here share nothing with `rig.geometry`: a mistake must not cancel itself out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.profile.world import Vector

Array = NDArray[np.float64]
Distortion = tuple[float, float, float, float, float]

_UNDISTORTED_WITHIN = 1e-10
_MOST_STEPS = 60


def rotation_matrix(rotation_deg: Vector) -> Array:
    """Turn a Rodrigues vector in degrees into a (3, 3) rotation matrix."""
    vector = np.radians(np.asarray(rotation_deg, np.float64))
    angle_rad = float(np.linalg.norm(vector))
    if angle_rad == 0.0:
        return np.eye(3)
    x, y, z = vector / angle_rad
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross


@dataclass(frozen=True, slots=True)
class TrueCamera:
    """One view as it truly is; a plain value, so that pictures can be cached by it."""

    view: str
    width_px: int
    height_px: int
    focal_px: float
    centre_px: tuple[float, float]
    """Principal point (x, y)."""
    position_mm: Vector
    """Optical centre in the world."""
    rotation_deg: Vector
    """Rodrigues vector of world_from_cam."""
    distortion: Distortion
    """Brown-Conrady k1, k2, p1, p2, k3."""

    @property
    def distorts(self) -> bool:
        """Whether the lens distorts at all."""
        return any(self.distortion)

    @property
    def rotation(self) -> Array:
        """Rotation part of world_from_cam, (3, 3)."""
        return rotation_matrix(self.rotation_deg)

    def directions(self, x_px: Array, y_px: Array) -> Array:
        """Return rays through pixels, (..., 3) in the camera frame with z = 1."""
        x = (x_px - self.centre_px[0]) / self.focal_px
        y = (y_px - self.centre_px[1]) / self.focal_px
        if self.distorts:
            x, y = undistorted(x, y, self.distortion)
        return np.stack(np.broadcast_arrays(x, y, 1.0), axis=-1)

    def pixels(self, points_mm: Array) -> Array:
        """Project world points (..., 3) in front of the camera to pixels (..., 2)."""
        seen = (points_mm - np.asarray(self.position_mm)) @ self.rotation
        x, y = distorted(seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2], self.distortion)
        return np.stack([x, y], axis=-1) * self.focal_px + np.asarray(self.centre_px)

    def pixel_grid(self) -> tuple[Array, Array]:
        """Return x and y of all pixel centres, each (H, W)."""
        x, y = np.meshgrid(np.arange(self.width_px), np.arange(self.height_px))
        return x.astype(np.float64), y.astype(np.float64)


def distorted(x: Array, y: Array, coefficients: Distortion) -> tuple[Array, Array]:
    """Apply Brown-Conrady distortion to normalised image coordinates.

    Source: D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37 (1971),
    with the coefficients in the order that OpenCV made customary.
    """
    radial, x_tangential, y_tangential = _terms(x, y, coefficients)
    return x * radial + x_tangential, y * radial + y_tangential


def undistorted(x: Array, y: Array, coefficients: Distortion) -> tuple[Array, Array]:
    """Invert `distorted` by fixed-point iteration.

    Raises:
        ValueError: the distortion is too strong to be inverted inside the picture.
    """
    x_free, y_free = x, y
    for _ in range(_MOST_STEPS):
        radial, x_tangential, y_tangential = _terms(x_free, y_free, coefficients)
        x_next, y_next = (x - x_tangential) / radial, (y - y_tangential) / radial
        change = max(np.max(np.abs(x_next - x_free)), np.max(np.abs(y_next - y_free)))
        x_free, y_free = x_next, y_next
        if change < _UNDISTORTED_WITHIN:
            return x_free, y_free
    raise ValueError(f"distortion {coefficients} cannot be inverted inside the picture")


def _terms(x: Array, y: Array, coefficients: Distortion) -> tuple[Array, Array, Array]:
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        radial,
        2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
