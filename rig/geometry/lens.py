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
    if model == "none":
        count = len(xy)
        eye = np.broadcast_to(np.eye(2), (count, 2, 2)).copy()
        return Distorted(np.array(xy, np.float64), eye, np.zeros((count, 2, 0)))
    if model == "fisheye":
        return _fisheye(k, xy)
    return _brown(k, xy)


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


def _brown(k: Float, xy: Float) -> Distorted:
    k1, k2, p1, p2, k3 = k[:5]
    k4, k5, k6 = k[5:] if len(k) == 8 else (0.0, 0.0, 0.0)
    x, y = np.asarray(xy, np.float64).T
    r2 = x * x + y * y
    r4, r6 = r2 * r2, r2 * r2 * r2
    above = 1.0 + k1 * r2 + k2 * r4 + k3 * r6
    below = 1.0 + k4 * r2 + k5 * r4 + k6 * r6
    radial = above / below
    # d radial / d r2, then d r2 / dx = 2 x.
    slope = (k1 + 2.0 * k2 * r2 + 3.0 * k3 * r4 - radial * (k4 + 2.0 * k5 * r2 + 3.0 * k6 * r4)) / (
        below
    )
    out = np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=1,
    )
    by_xy = np.empty((len(x), 2, 2))
    by_xy[:, 0, 0] = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    by_xy[:, 0, 1] = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    by_xy[:, 1, 0] = by_xy[:, 0, 1]
    by_xy[:, 1, 1] = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    by_k = np.empty((len(x), 2, len(k)))
    for column, power in ((0, r2), (1, r4), (4, r6)):
        by_k[:, 0, column], by_k[:, 1, column] = x * power / below, y * power / below
    by_k[:, 0, 2], by_k[:, 1, 2] = 2.0 * x * y, r2 + 2.0 * y * y
    by_k[:, 0, 3], by_k[:, 1, 3] = r2 + 2.0 * x * x, 2.0 * x * y
    if len(k) == 8:
        for column, power in ((5, r2), (6, r4), (7, r6)):
            change = -radial * power / below
            by_k[:, 0, column], by_k[:, 1, column] = x * change, y * change
    return Distorted(out, by_xy, by_k)


def _fisheye(k: Float, xy: Float) -> Distorted:
    x, y = np.asarray(xy, np.float64).T
    r = np.hypot(x, y)
    angle = np.arctan(r)
    a2 = angle * angle
    powers = np.stack([a2, a2**2, a2**3, a2**4])
    bent = angle * (1.0 + k @ powers)
    bent_by_angle = 1.0 + (k * np.array([3.0, 5.0, 7.0, 9.0])) @ powers
    near = r < _SMALL_RADIUS
    safe = np.where(near, 1.0, r)
    scale = np.where(near, 1.0, bent / safe)
    # d scale / d r, divided by r: multiplies x * x and so on.
    change = np.where(near, 0.0, (bent_by_angle / (1.0 + r * r) - scale) / (safe * safe))
    by_xy = np.empty((len(x), 2, 2))
    by_xy[:, 0, 0] = scale + x * x * change
    by_xy[:, 0, 1] = by_xy[:, 1, 0] = x * y * change
    by_xy[:, 1, 1] = scale + y * y * change
    direction = np.stack([x, y], axis=1) / safe[:, None]
    by_k = direction[:, :, None] * (angle * powers).T[:, None, :]
    return Distorted(np.stack([x, y], axis=1) * scale[:, None], by_xy, by_k)
