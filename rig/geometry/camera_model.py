"""One camera: focal lengths, principal point and lens."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.lens import COEFFICIENTS, LensModel, distort, undistort


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Intrinsics of one camera; pixel (0, 0) is the centre of the top-left pixel."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    lens: LensModel = "none"
    coefficients: tuple[float, ...] = ()
    """Of the lens model, in the order that `rig.geometry.lens` tells."""

    def __post_init__(self) -> None:
        numbers = (self.fx_px, self.fy_px, self.cx_px, self.cy_px, *self.coefficients)
        if not (np.isfinite(numbers).all() and self.fx_px > 0 and self.fy_px > 0):
            raise ConfigError(
                f"camera with focal lengths {self.fx_px:g}, {self.fy_px:g} px asked for",
                advice="they must be positive and all its numbers finite",
            )
        if self.width_px < 1 or self.height_px < 1:
            raise ConfigError(
                f"camera of {self.width_px} x {self.height_px} px asked for",
                advice="give its picture size",
            )
        if self.lens not in COEFFICIENTS or len(self.coefficients) != COEFFICIENTS[self.lens]:
            raise ConfigError(
                f"lens model {self.lens} with {len(self.coefficients)} coefficients asked for",
                advice=f"known are {', '.join(f'{m} ({n})' for m, n in COEFFICIENTS.items())}",
            )

    @property
    def matrix(self) -> Float:
        """(3, 3) camera matrix K."""
        return np.array(
            [[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]]
        )

    def project(self, points_mm: Float) -> Float:
        """Pixels (N, 2) of points (N, 3) in the camera's frame; NaN for points not before it."""
        points = np.asarray(points_mm, np.float64)
        depth = points[:, 2]
        ahead = depth > 0
        xy = points[:, :2] / np.where(ahead, depth, 1.0)[:, None]
        bent = distort(self.lens, np.array(self.coefficients), xy).xy
        pixels = bent * (self.fx_px, self.fy_px) + (self.cx_px, self.cy_px)
        pixels[~ahead] = np.nan
        return pixels

    def unproject(self, pixels: Float) -> Float:
        """Ideal normalised coordinates (N, 2) (X / Z, Y / Z) of pixels (N, 2).

        NaN where the lens model has no inverse.
        """
        centred = np.asarray(pixels, np.float64) - (self.cx_px, self.cy_px)
        return undistort(self.lens, np.array(self.coefficients), centred / (self.fx_px, self.fy_px))
