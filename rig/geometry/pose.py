"""Rigid motions between frames; a name reads `to_from`, as in `cam_from_board`."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError

_SMALL_RAD = 1e-4
"""Below this the sine of an angle is the angle, to 2e-13."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Takes points of one frame into another: p_to = rotation @ p_from + translation."""

    rotation: Float
    """(3, 3), orthogonal, determinant 1."""
    translation_mm: Float
    """(3,)."""

    def __post_init__(self) -> None:
        rotation = np.ascontiguousarray(self.rotation, np.float64)
        translation = np.ascontiguousarray(self.translation_mm, np.float64).reshape(-1)
        if rotation.shape != (3, 3) or translation.shape != (3,):
            raise ConfigError(
                f"pose of a {rotation.shape} rotation and {translation.shape} translation asked "
                "for",
                advice="give (3, 3) and (3,)",
            )
        off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
        if not (off < 1e-6 and np.linalg.det(rotation) > 0 and np.isfinite(translation).all()):
            raise ConfigError(
                f"pose is no rigid motion: R R^T is {off:.2g} away from identity, determinant "
                f"{np.linalg.det(rotation):.3g}",
                advice="give a finite rotation and translation",
            )
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation_mm", translation)

    @classmethod
    def identity(cls) -> Self:
        """Return the motion that leaves every point where it is."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_vectors(cls, rotation_rad: Float, translation_mm: Float) -> Self:
        """Return the pose of a Rodrigues vector (axis times angle, rad) and a translation."""
        rotation, _ = cv2.Rodrigues(np.asarray(rotation_rad, np.float64).reshape(3, 1))
        return cls(np.asarray(rotation, np.float64), translation_mm)

    @property
    def rotation_rad(self) -> Float:
        """(3,) Rodrigues vector of the rotation."""
        r = self.rotation
        sine = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        if np.abs(sine).max() < _SMALL_RAD and np.trace(r) > 0:
            return sine  # OpenCV gives 0 below 1e-5 rad, a hundredth of a pixel
        vector, _ = cv2.Rodrigues(r)
        return np.asarray(vector, np.float64).reshape(3)

    def __matmul__(self, other: "Pose") -> "Pose":
        """Chain: `a_from_b @ b_from_c` is `a_from_c`."""
        return Pose(
            self.rotation @ other.rotation,
            self.rotation @ other.translation_mm + self.translation_mm,
        )

    def inverse(self) -> "Pose":
        """Return the motion back."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation_mm)

    def apply(self, points_mm: Float) -> Float:
        """Take points (..., 3) into the other frame."""
        return np.asarray(points_mm, np.float64) @ self.rotation.T + self.translation_mm

    @property
    def centre_mm(self) -> Float:
        """(3,) origin of the `to` frame, seen from the `from` frame: where the camera stands."""
        return -self.rotation.T @ self.translation_mm
