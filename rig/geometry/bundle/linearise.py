"""Projection of every observed point, with analytic derivatives by everything it depends on."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.chain import chain
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.rotations import apply
from rig.geometry.bundle.unknowns import POSE, WARP, Unknowns
from rig.geometry.lens import COEFFICIENTS, distort


@dataclass(frozen=True, slots=True)
class Target:
    """The flat target and the plane its bending is told over."""

    points_mm: Float
    """(P, 3), z = 0."""

    @property
    def centre_mm(self) -> Float:
        """(2,) middle of its extent."""
        plane = self.points_mm[:, :2]
        return (plane.min(axis=0) + plane.max(axis=0)) / 2

    @property
    def half_mm(self) -> Float:
        """(2,) half its extent; 1 where it has none."""
        plane = self.points_mm[:, :2]
        half = (plane.max(axis=0) - plane.min(axis=0)) / 2
        return np.where(half > 0, half, 1.0)

    @property
    def bending(self) -> Float:
        """(P, 3) X^2, X Y, Y^2 of each point, X and Y from -1 to 1."""
        x, y = ((self.points_mm[:, :2] - self.centre_mm) / self.half_mm).T
        return np.stack([x * x, x * y, y * y], axis=1)

    def bent_mm(self, warp_mm: Float) -> Float:
        """(P, 3) points of the bent board."""
        bent = self.points_mm.copy()
        bent[:, 2] += np.einsum("pk,k->p", self.bending, warp_mm)
        return bent


@dataclass(frozen=True, slots=True)
class Linearised:
    """Residuals of M points and how their projections move."""

    residual_px: Float
    """(M, 2) found minus projected; infinite where the point is not before the camera."""
    jacobian: Float
    """(M, 2, 4 + K + 6 + 3 + 6) of the projection by intrinsics, place of the view, warp, pose."""


def linearise(observed: Observations, target: Target, at: Unknowns) -> Linearised:
    """Project every observed point and differentiate.

    Turns are left perturbations, R becomes exp(w) R. Against difference quotients with steps of
    1e-6 the columns agree to 1e-6 of their largest entry: 1e-4 to 1e-2 means a missing lens term
    (wrong only away from the picture's middle), 1 to 2 a sign or a transposed rotation, and a
    column that is wrong only for views other than the reference a frame mixed up.
    """
    longest = max(COEFFICIENTS[lens] for lens in at.lenses)
    residual = np.empty_like(observed.xy_px)
    jacobian = np.empty((len(residual), 2, 4 + longest + POSE + WARP + POSE))
    sighting = observed.sighting_of_point
    view = observed.view[sighting]
    rotation, shift_mm = at.boards_shown(observed.picture)
    turned = apply(rotation[sighting], target.bent_mm(at.warp_mm)[observed.ids])
    inner = turned + shift_mm[sighting]
    bending = target.bending[observed.ids]
    for index, lens in enumerate(at.lenses):
        rows = np.flatnonzero(view == index)
        numbers = at.intrinsics[index]
        swung = apply(at.view_rotation[index], inner[rows])
        xyz = swung + at.view_shift_mm[index]
        ahead = xyz[:, 2] > 0
        depth = np.where(ahead, xyz[:, 2], 1.0)
        xy = xyz[:, :2] / depth[:, None]
        bent = distort(lens, numbers[4:], xy)
        projected = bent.xy * numbers[:2] + numbers[2:4]
        residual[rows] = np.where(ahead[:, None], observed.xy_px[rows] - projected, np.inf)
        chain(
            jacobian, rows, numbers, bent.xy, bent.by_xy, bent.by_coefficients, xy, depth, swung,
            turned[rows], at.view_rotation[index], rotation[sighting[rows]], bending[rows],
            longest,
        )  # fmt: skip
    return Linearised(residual, jacobian)
