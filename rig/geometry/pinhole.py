"""The camera that a depth map is seen by: a pinhole, and how it stands to the reference camera."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import CalibrationError, FormatError

_DEPTH = "along +z of the reference camera, from its optical centre, mm"


@dataclass(frozen=True, eq=False, slots=True)
class Pinhole:
    """No lens, square pixels, pixel centres at integers."""

    width_px: int
    """Of the depth map."""
    height_px: int
    """Of the depth map."""
    focal_px: float
    """Focal length."""
    principal_point_px: tuple[float, float]
    """(x, y)."""
    common_from_reference: Float
    """(3, 3) rotation from the frame of the reference camera, which depth counts in, into that of
    the rectified views, which the pixels are of. The identity for rigs without a calibration."""

    @property
    def matrix(self) -> Float:
        """(3, 3) `K` of this pinhole: pixel = K point / z, in the frame of the rectified views."""
        x_px, y_px = self.principal_point_px
        return np.array(
            [[self.focal_px, 0.0, x_px], [0.0, self.focal_px, y_px], [0.0, 0.0, 1.0]], np.float64
        )

    def points_mm(self, depth_mm: NDArray[np.float32]) -> Float:
        """Points (H, W, 3) in the reference camera's frame (x right, y down, z forward).

        Args:
            depth_mm: (H, W) along the reference camera's +z; NaN where there is no answer, and
                there all three coordinates are.

        Raises:
            CalibrationError: the map is of another size.
        """
        if depth_mm.shape != (self.height_px, self.width_px):
            raise CalibrationError(
                f"asked for points of a depth map of {_size(depth_mm.shape)} px, the camera is of "
                f"{self.width_px} x {self.height_px} px",
                advice="give the camera that the map was measured with",
            )
        x_px, y_px = self.principal_point_px
        y, x = np.indices(depth_mm.shape, dtype=np.float64)
        rays = np.stack(
            [(x - x_px) / self.focal_px, (y - y_px) / self.focal_px, np.ones_like(x)], axis=-1
        )
        in_reference = rays @ self.common_from_reference
        return in_reference * (depth_mm / in_reference[..., 2])[..., None]

    def cut(self, x_px: int, y_px: int, size_px: tuple[int, int]) -> "Pinhole":
        """Return the camera of a part of its maps.

        Args:
            x_px: first column of the part.
            y_px: its first row.
            size_px: its width and height.
        """
        centre_x_px, centre_y_px = self.principal_point_px
        return replace(
            self,
            width_px=size_px[0],
            height_px=size_px[1],
            principal_point_px=(centre_x_px - x_px, centre_y_px - y_px),
        )

    def decimated(self, factor: int) -> "Pinhole":
        """Return the camera of maps whose pixels are squares of its own, `factor` px a side."""
        middle_px = (factor - 1) / 2.0
        centre_x_px, centre_y_px = self.principal_point_px
        return replace(
            self,
            width_px=self.width_px // factor,
            height_px=self.height_px // factor,
            focal_px=self.focal_px / factor,
            principal_point_px=(
                (centre_x_px - middle_px) / factor,
                (centre_y_px - middle_px) / factor,
            ),
        )

    def to_json(self) -> dict[str, object]:
        """Return what a reader of maps needs to turn pixels into rays of the reference camera."""
        return {
            "width_px": self.width_px,
            "height_px": self.height_px,
            "focal_px": self.focal_px,
            "principal_point_px": list(self.principal_point_px),
            "common_from_reference": self.common_from_reference.tolist(),
            "depth": _DEPTH,
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "Pinhole":
        """Return the camera that `to_json` wrote.

        Raises:
            FormatError: keys are missing, or numbers are no camera.
        """
        try:
            x_px, y_px = map(float, content["principal_point_px"])
            rotation = np.asarray(content["common_from_reference"], np.float64)
            found = cls(
                int(content["width_px"]),
                int(content["height_px"]),
                float(content["focal_px"]),
                (x_px, y_px),
                rotation,
            )
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise FormatError(f"no camera of depth maps: {error!r}") from error
        numbers = np.array([found.focal_px, x_px, y_px])
        is_rotation = rotation.shape == (3, 3) and np.allclose(rotation @ rotation.T, np.eye(3))
        sizes = found.width_px > 0 and found.height_px > 0 and found.focal_px > 0.0
        if not (is_rotation and sizes and np.isfinite(numbers).all()):
            raise FormatError(
                f"no camera of depth maps: {found.width_px} x {found.height_px} px, focal length "
                f"{found.focal_px} px about ({x_px}, {y_px}), rotation {rotation.tolist()}"
            )
        return found


def _size(shape: tuple[int, ...]) -> str:
    """Width first."""
    return " x ".join(str(count) for count in reversed(shape))
