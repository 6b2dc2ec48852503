"""What a geometric calibration knows: every camera, its place, and the stage."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose


@dataclass(frozen=True, slots=True)
class StageGeometry:
    """How the stage carries the board, in the frame of the reference camera.

    A stage at position s (mm, as the driver reads it) has moved the board by
    `scale * (s - s0) * axis` from where it stood at s0; the board's centre lies at the distance
    `scale * s + zero_mm` along the optical axis where the axis is parallel to it.
    """

    axis: Float
    """(3,) unit vector of growing positions."""
    scale: float
    """True mm per mm of the driver."""
    zero_mm: float
    """Distance of the board's centre along +z at driver position 0."""
    covariance: Float
    """(4, 4) of axis x, axis y, scale, zero_mm."""

    def __post_init__(self) -> None:
        if self.axis.shape != (3,) or self.covariance.shape != (4, 4):
            raise ConfigError(
                f"stage with an axis of shape {self.axis.shape} and a covariance of shape "
                f"{self.covariance.shape} asked for",
                advice="give (3,) and (4, 4)",
            )


@dataclass(frozen=True, slots=True)
class RigGeometry:
    """All views of a rig in one frame: that of the reference camera (x right, y down, z forward).

    The covariance is over the parameters in this order: per view fx, fy, cx, cy and the lens
    coefficients, views in order; then per view other than the reference its Rodrigues vector (rad)
    and translation (mm) of `cam_from_reference`, views in order.
    """

    names: tuple[str, ...]
    """Views, in the order of the profile."""
    reference: int
    """Index of the reference view."""
    cameras: tuple[CameraModel, ...]
    """One per view."""
    cam_from_reference: tuple[Pose, ...]
    """One per view; identity for the reference."""
    covariance: Float | None = None
    """(P, P); None for a geometry that was imported without one."""
    stage: StageGeometry | None = None
    """None where no stage took part."""

    def __post_init__(self) -> None:
        count = len(self.names)
        if not (len(self.cameras) == len(self.cam_from_reference) == count > 0):
            raise ConfigError(
                f"geometry of {count} views with {len(self.cameras)} cameras and "
                f"{len(self.cam_from_reference)} poses asked for",
                advice="give one of each for every view",
            )
        if not 0 <= self.reference < count:
            raise ConfigError(
                f"reference view {self.reference} asked for, views are 0..{count - 1}",
                advice="name one of them",
            )
        size = self.parameter_count
        if self.covariance is not None and self.covariance.shape != (size, size):
            raise ConfigError(
                f"covariance {self.covariance.shape} given for {size} parameters of the geometry",
                advice="give one row and column for each",
            )

    @property
    def parameter_count(self) -> int:
        """How many numbers the covariance is over."""
        lenses = sum(4 + len(camera.coefficients) for camera in self.cameras)
        return lenses + 6 * (len(self.cameras) - 1)

    def project(self, view: int, points_mm: Float) -> Float:
        """Pixels (N, 2) in one view of points (N, 3) in the reference frame."""
        return self.cameras[view].project(self.cam_from_reference[view].apply(points_mm))

    def centres_mm(self) -> Float:
        """(V, 3) optical centres in the reference frame."""
        return np.stack([pose.centre_mm for pose in self.cam_from_reference])
