"""Projection of every observed point, with analytic derivatives by everything it depends on."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.geometry.bundle.imaging import Imaging, differentiate, project
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.unknowns import POSE, WARP, Unknowns
from rig.geometry.lens import COEFFICIENTS
from rig.geometry.lens_points import filled_up

FEWEST_SHARED = 5000
"""Points below which a thread that wakes costs as much as it saves."""


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


def linearise(
    observed: Observations, target: Target, at: Unknowns, jacobian: Float | None = None
) -> Linearised:
    """Project every observed point and differentiate.

    Turns are left perturbations, R becomes exp(w) R. Against difference quotients with steps of
    1e-6 the columns agree to 1e-6 of their largest entry: 1e-4 to 1e-2 means a missing lens term
    (wrong only away from the picture's middle), 1 to 2 a sign or a transposed rotation, and a
    column that is wrong only for views other than the reference a frame mixed up.

    Args:
        observed: what was found.
        target: the board.
        at: where to differentiate.
        jacobian: of an earlier call that is not needed any more, to be written over.
    """
    imaging = _imaging(observed, target, at)
    longest = int(imaging.coefficients.max())
    residual = np.empty_like(observed.xy_px)
    if jacobian is None:
        jacobian = np.empty((len(residual), 2, 4 + longest + POSE + WARP + POSE))
    rows = jacobian

    def work(first: int, last: int) -> None:
        differentiate(imaging, observed.xy_px, longest, first, last, rows, residual)

    share_out(work, len(observed.view), len(residual))
    return Linearised(residual, rows)


def residuals_px(observed: Observations, target: Target, at: Unknowns) -> Float:
    """(M, 2) found minus projected; infinite where the point is not before the camera."""
    imaging = _imaging(observed, target, at)
    residual = np.empty_like(observed.xy_px)

    def work(first: int, last: int) -> None:
        project(imaging, observed.xy_px, first, last, residual)

    share_out(work, len(observed.view), len(residual))
    return residual


def share_out(work: Callable[[int, int], None], count: int, points: int) -> None:
    """Do work on so many sightings or pictures, on several threads where points are enough."""
    if points < FEWEST_SHARED:
        work(0, count)
    else:
        run_in_bands(work, count)


def _imaging(observed: Observations, target: Target, at: Unknowns) -> Imaging:
    rotation, shift_mm = at.boards_shown(observed.picture)
    return Imaging(
        points_mm=np.ascontiguousarray(target.bent_mm(at.warp_mm)),
        bending=np.ascontiguousarray(target.bending),
        ids=observed.ids,
        start=observed.start,
        seen_by=observed.view,
        board_rotation=np.ascontiguousarray(rotation),
        board_shift_mm=np.ascontiguousarray(shift_mm),
        view_rotation=np.ascontiguousarray(at.view_rotation),
        view_shift_mm=np.ascontiguousarray(at.view_shift_mm),
        numbers=np.stack([np.concatenate([v[:4], filled_up(v[4:])]) for v in at.intrinsics]),
        is_fisheye=np.array([lens == "fisheye" for lens in at.lenses]),
        coefficients=np.array([COEFFICIENTS[lens] for lens in at.lenses], np.int64),
    )
