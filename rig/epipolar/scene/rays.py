"""Where cameras should see what the reference sees, and by how much they do not.

A feature's ray in the reference is taken as exact; its inverse depth is free. What no inverse depth
explains is across the epipolar line of a pair, and along it as well where three views or more
disagree about the depth.
"""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Flags, Float
from rig.epipolar.scene.features import SceneFeatures
from rig.epipolar.scene.numbers import lens_slice, numbers_of, pose_slice, steps_of, with_numbers
from rig.geometry.rig_geometry import RigGeometry

_ROUNDS = 3
_STEP = 1e-4
"""Of the inverse depth, as a share of one over the longest baseline."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """Of N features in V views, in units of their sigmas; 0 where a view does not show one."""

    residual: Float
    """(N, V, 2) found minus expected at the best inverse depth."""
    by_inverse: Float
    """(N, V, 2) derivative of what is expected by the inverse depth."""
    inverse_per_mm: Float
    """(N,) best inverse depths."""
    known: Flags
    """(N,) features that every camera model has a ray for."""

    @property
    def spare(self) -> Float:
        """(N,) coordinates that are left once the inverse depth is free."""
        shown = (self.by_inverse != 0.0).any(axis=2).sum(axis=1)
        return np.maximum(2.0 * shown - 1.0, 1.0)

    @property
    def squares(self) -> Float:
        """(N,) sum of squares over what is spare."""
        return np.square(self.residual).sum(axis=(1, 2)) / self.spare


def misfit(geometry: RigGeometry, features: SceneFeatures) -> Misfit:
    """Compare features with a geometry; each takes its best inverse depth."""
    rays = _rays(geometry, features)
    known = np.isfinite(rays[:, 0] + rays[:, 1])
    inverse = _linear(geometry, features, rays)
    unit = _STEP / _longest_mm(geometry)
    residual = _residual(geometry, features, rays, inverse)
    slope = np.zeros_like(residual)
    for _ in range(_ROUNDS):
        ahead = _residual(geometry, features, rays, inverse + unit)
        slope = (residual - ahead) / unit
        power = np.square(slope).sum(axis=(1, 2))
        step = (slope * residual).sum(axis=(1, 2)) / np.where(power > 0.0, power, 1.0)
        inverse = inverse + step
        residual = _residual(geometry, features, rays, inverse)
    return Misfit(residual, slope, inverse, known)


def derivatives(geometry: RigGeometry, features: SceneFeatures, at: Misfit) -> Float:
    """(N, V, 2, P) of what is expected by the numbers of the geometry, the depth left free."""
    numbers, steps = numbers_of(geometry), steps_of(geometry)
    found = np.zeros((*at.residual.shape, len(numbers)))
    rays = _rays(geometry, features)
    for view in range(len(geometry.cameras)):
        own, pose = lens_slice(geometry, view), pose_slice(geometry, view)
        is_reference = view == geometry.reference
        for place in (*range(own.start, own.stop), *range(pose.start, pose.stop)):
            both: list[Float] = []
            for sign in (-1.0, 1.0):
                moved = numbers.copy()
                moved[place] += sign * steps[place]
                other = with_numbers(geometry, moved)
                seen = _rays(other, features) if is_reference else rays
                only = None if is_reference else view
                both.append(_residual(other, features, seen, at.inverse_per_mm, only))
            found[..., place] = (both[0] - both[1]) / (2.0 * steps[place])
    power = np.square(at.by_inverse).sum(axis=(1, 2))
    unit = at.by_inverse / np.sqrt(np.where(power > 0.0, power, 1.0))[:, None, None]
    along = np.einsum("nvc,nvcp->np", unit, found)
    return found - unit[..., None] * along[:, None, None, :]


def _rays(geometry: RigGeometry, features: SceneFeatures) -> Float:
    """(N, 3) in the reference camera's frame, z = 1."""
    rays = np.ones((len(features), 3))
    rays[:, :2] = geometry.cameras[geometry.reference].unproject(features.reference_px)
    return rays


def _residual(
    geometry: RigGeometry,
    features: SceneFeatures,
    rays: Float,
    inverse_per_mm: Float,
    only: int | None = None,
) -> Float:
    """(N, V, 2) found minus expected, in sigmas; of one view alone the others are 0."""
    residual = np.zeros(features.view_px.shape)
    for view, pose in enumerate(geometry.cam_from_reference):
        if view == geometry.reference or (only is not None and view != only):
            continue
        points = rays @ pose.rotation.T + inverse_per_mm[:, None] * pose.translation_mm
        away = features.view_px[:, view] - geometry.cameras[view].project(points)
        residual[:, view] = away / features.sigma_px[:, view, None]
    return np.where(np.isfinite(residual), residual, 0.0)


def _linear(geometry: RigGeometry, features: SceneFeatures, rays: Float) -> Float:
    """(N,) inverse depths by linear least squares over all views, in their undistorted pictures."""
    above, below = np.zeros(len(rays)), np.zeros(len(rays))
    for view, pose in enumerate(geometry.cam_from_reference):
        if view == geometry.reference:
            continue
        shown = features.seen[:, view]
        seen = geometry.cameras[view].unproject(features.view_px[shown, view])
        turned, shift = rays[shown] @ pose.rotation.T, pose.translation_mm
        a = shift[:2] - seen * shift[2]
        b = seen * turned[:, 2:] - turned[:, :2]
        good = np.isfinite(a).all(axis=1)
        above[np.flatnonzero(shown)[good]] += (a * b).sum(axis=1)[good]
        below[np.flatnonzero(shown)[good]] += (a * a).sum(axis=1)[good]
    return above / np.where(below > 0.0, below, 1.0)


def _longest_mm(geometry: RigGeometry) -> float:
    return max(float(np.linalg.norm(pose.translation_mm)) for pose in geometry.cam_from_reference)
