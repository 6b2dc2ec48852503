"""Lens distortion: from ideal to distorted normalised coordinates, with analytic derivatives.

Normalised coordinates are x = X / Z, y = Y / Z in the camera frame. Three models:

- `brown5`, `brown8`: D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering
  37(8), 1971, with 2 + 1 or (rational) 3 + 3 radial and 2 tangential coefficients in OpenCV's order
  k1, k2, p1, p2, k3, k4, k5, k6.
- `fisheye`: J. Kannala and S. Brandt, "A generic camera model and calibration method for
  conventional, wide-angle, and fish-eye lenses", IEEE TPAMI 28(8), 2006; k1..k4 of the odd
  powers of the angle.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.lens_points import bend_points, filled_up

LensModel = Literal["none", "brown5", "brown8", "fisheye"]

COEFFICIENTS: dict[LensModel, int] = {"none": 0, "brown5": 5, "brown8": 8, "fisheye": 4}
"""How many coefficients each model has."""

_SMALL_RADIUS = 1e-8
_NEWTON_STEPS = 30
_NEWTON_DONE = 1e-13


@dataclass(frozen=True, slots=True)
class Distorted:
    """Distorted points and how they move with the ideal points and the coefficients."""

    xy: Float
    """(N, 2) distorted normalised coordinates."""
    by_xy: Float
    """(N, 2, 2) derivative by the ideal coordinates."""
    by_coefficients: Float
    """(N, 2, K) derivative by the coefficients."""


def distort(model: LensModel, coefficients: Float, xy: Float) -> Distorted:
    """Distort ideal normalised coordinates.

    Args:
        model: lens model.
        coefficients: (K,) in the order of the module's text.
        xy: (N, 2) ideal normalised coordinates.

    Raises:
        ConfigError: the number of coefficients is not that of the model.
    """
    k = np.asarray(coefficients, np.float64)
    if k.shape != (COEFFICIENTS[model],):
        raise ConfigError(
            f"lens model {model} asked for with {k.size} coefficients",
            advice=f"give {COEFFICIENTS[model]}",
        )
    points = np.ascontiguousarray(xy, np.float64)
    count = len(points)
    bent, by_xy = np.empty((count, 2)), np.empty((count, 2, 2))
    by_k = np.empty((count, 2, k.size))
    bend_points(model == "fisheye", filled_up(k), points, bent, by_xy, by_k)
    return Distorted(bent, by_xy, by_k)


def undistort(model: LensModel, coefficients: Float, xy_distorted: Float) -> Float:
    """Ideal normalised coordinates (N, 2) of distorted ones, to 1e-12; NaN where there are none.

    Newton's method with the analytic derivative; a lens model that folds has places without an
    inverse, which come back as NaN instead of a point that does not project there.
    """
    wanted = np.asarray(xy_distorted, np.float64)
    xy = wanted.copy()
    if model == "fisheye":
        angle = np.linalg.norm(wanted, axis=1)
        # The distorted radius is about the angle; its tangent is a far better start than itself.
        stretch = np.tan(np.minimum(angle, 1.5)) / np.maximum(angle, _SMALL_RADIUS)
        xy *= np.where(angle > _SMALL_RADIUS, stretch, 1.0)[:, None]
    for _ in range(_NEWTON_STEPS):
        now = distort(model, coefficients, xy)
        miss = now.xy - wanted
        det = now.by_xy[:, 0, 0] * now.by_xy[:, 1, 1] - now.by_xy[:, 0, 1] * now.by_xy[:, 1, 0]
        det = np.where(np.abs(det) > 1e-6, det, np.nan)
        step_x = (now.by_xy[:, 1, 1] * miss[:, 0] - now.by_xy[:, 0, 1] * miss[:, 1]) / det
        step_y = (now.by_xy[:, 0, 0] * miss[:, 1] - now.by_xy[:, 1, 0] * miss[:, 0]) / det
        xy -= np.stack([step_x, step_y], axis=1)
        if not np.nanmax(np.abs(miss), initial=0.0) > _NEWTON_DONE:
            break
    there = distort(model, coefficients, xy)
    reached = np.abs(there.xy - wanted).max(axis=1) < 1e-10
    # Beyond a fold the picture runs backwards: a point there is not what the camera shows.
    (xx, xy_), (yx, yy) = np.moveaxis(np.where(reached[:, None, None], there.by_xy, 0.0), 0, -1)
    upright = (xx * yy - xy_ * yx > 0) & (xx + yy > 0)
    xy[~(reached & upright)] = np.nan
    return xy
