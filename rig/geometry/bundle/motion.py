"""How far a board moves between the views of one picture, measured from the pictures themselves.

Views that are not exposed at the same moment see a moving board in different places. A common pose
would push the difference into lenses and places of the cameras. Here each sighting has a pose of
its own, tied to the picture's by a variance that the pictures tell: nothing where views are
synchronous; where they are not, lenses are learned from what each view sees by itself, and places
from what is left of the agreement.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.linearise import Linearised, Target
from rig.geometry.bundle.normal import Reduced, form, solve
from rig.geometry.bundle.observations import FEWEST_POINTS, Observations
from rig.geometry.bundle.rotations import apply, cross_matrix
from rig.geometry.bundle.settle import Problem
from rig.geometry.bundle.unknowns import POSE, Unknowns

Bool = NDArray[np.bool_]

FREEDOM = 4.0
"""How many numbers the belief is worth that a picture moves like the others. Boards are held still
in some pictures and swung in others, so it is worth little."""
CERTAIN = 6.0
"""Sigmas by which sightings must pull apart before a motion is believed."""
_STILL = np.array([1e-9, 1e-6])
"""Ties, rad and mm, of what cannot move."""
_KINDS = (slice(0, 3), slice(3, 6))


@dataclass(frozen=True, slots=True)
class Motion:
    """Scales of the motion between a picture's pose of the board and that in one view."""

    sigma: Float
    """(2,) about (rad) and along (mm) each axis through the board's middle."""
    picture_scale: Float
    """(N,) a picture's own factor: 1 moves like the others, 0 is known to be at rest."""
    dof: float
    """How many numbers of the residuals the motions explain."""

    def sigmas(self, observed: Observations) -> Float:
        """(S, 2) of each sighting."""
        return np.maximum(self.sigma * self.picture_scale[observed.picture][:, None], _STILL)

    def ties(self, at: Unknowns, target: Target, observed: Observations) -> Float:
        """(S, 6, 6) information about each sighting's motion, as `Unknowns.motion` tells it."""
        middle = _middle_by_origin(at, target, observed)
        inverse = np.repeat(self.sigmas(observed) ** -2.0, 3, axis=1)
        return np.einsum("ski,sk,skj->sij", middle, inverse, middle)


def _middle_by_origin(at: Unknowns, target: Target, observed: Observations) -> Float:
    """(S, 6, 6) from a motion about the board's origin to the same about its middle."""
    arm_mm = apply(at.board_rotation, np.array([*target.centre_mm, 0.0]))[observed.picture]
    matrix = np.broadcast_to(np.eye(POSE), (len(arm_mm), POSE, POSE)).copy()
    matrix[:, 3:, :3] = -cross_matrix(arm_mm)
    return matrix


def notice_motion(
    problem: Problem, at: Unknowns, linear: Linearised, weight: Float, resting: Bool
) -> Motion | None:
    """Tell whether views of one picture disagree about the board by more than chance, and how far.

    Score test of a variance of zero: the pulls g of sightings on the board's pose have the variance
    H, less what the fit took, if they are noise, and more if the board moved.

    Args:
        problem: the solve, boards at rest.
        at: its solution.
        linear: taken there.
        weight: (M,) inverse variances.
        resting: (N,) pictures in which nothing can have moved.

    Returns:
        A first guess of the scales, too large rather than too small; None where chance explains it.
    """
    observed, size = problem.observed, len(problem.observed.pictures)
    normal = form(observed, problem.target, at, problem.layout, linear, weight, problem.stops)
    reduced = normal.reduced()
    inverse = solve(reduced.matrix, np.eye(problem.layout.count)) if reduced else None
    if reduced is None or inverse is None:
        return None
    grams = _pose_grams(observed, linear, weight)
    own, pulled = grams[:, :, -1 - POSE : -1], grams[:, :, -1]
    shown = np.add.reduceat(weight > 0, observed.start[:-1], dtype=np.int64) >= FEWEST_POINTS
    # A pose that one view alone tells takes all its pulls: what is left is rounding.
    together = np.bincount(observed.picture[shown], minlength=size) > 1
    moving = shown & ~resting[observed.picture] & together[observed.picture]
    if not moving.any():
        return None
    spread = own - _through(problem, reduced, inverse, grams)
    by_middle = np.linalg.inv(_middle_by_origin(at, problem.target, observed))
    pulled = np.einsum("ski,sk->si", by_middle, pulled)[moving]
    spread = np.einsum("ski,skl,slj->sij", by_middle, spread, by_middle)[moving]
    own = np.einsum("ski,skl,slj->sij", by_middle, own, by_middle)[moving]
    certain, sigma = 0.0, np.zeros(2)
    for kind, part in enumerate(_KINDS):
        excess = np.sum(pulled[:, part] ** 2) - np.einsum("sii->", spread[:, part, part])
        chance = np.sqrt(2.0 * np.sum(spread[:, part, part] ** 2))
        certain = max(certain, float(excess / chance)) if chance > 0 else certain
        apart = np.linalg.solve(own[:, part, part], pulled[:, part, None])[:, :, 0]
        sigma[kind] = np.sqrt(np.median(np.sum(apart**2, axis=1)) / 3.0)
    if certain < CERTAIN:
        return None
    return Motion(sigma, np.where(resting, 0.0, np.ones(size)), 0.0)


def measure_motion(
    problem: Problem, at: Unknowns, linear: Linearised, weight: Float, motion: Motion, resting: Bool
) -> Motion:
    """Take one step towards the likeliest variances.

    S. N. Wood, M. Fasiolo, "A generalized Fellner-Schall method for smoothing parameter
    optimization", Biometrics 73(4), 2017: a variance is the squares of the predicted motions over
    how many numbers the data, not the tie, decided. All other unknowns, cameras too, are integrated
    out, so this climbs the restricted likelihood. Pictures have factors of their own, as under
    Student's t.

    Args:
        problem: the solve, with ties.
        at: its solution, with motions.
        linear: taken there.
        weight: (M,) inverse variances.
        motion: what the ties came from.
        resting: (N,) pictures in which nothing can have moved.
    """
    observed, tie = problem.observed, problem.tie
    normal = form(observed, problem.target, at, problem.layout, linear, weight, problem.stops, tie)
    reduced = normal.reduced()
    inverse = solve(reduced.matrix, np.eye(problem.layout.count)) if reduced else None
    if reduced is None or inverse is None or tie is None or at.motion is None:
        return motion
    own = _pose_grams(observed, linear, weight)[:, :, -1 - POSE : -1]
    spread = np.linalg.inv(own + tie) + _through(problem, reduced, inverse, normal.follow)
    middle = _middle_by_origin(at, problem.target, observed)
    moved = np.einsum("sij,sj->si", middle, at.motion)
    variance = np.einsum("sij,sjk,sik->si", middle, spread, middle)
    sigmas = motion.sigmas(observed)
    squares = np.stack([np.sum(moved[:, k] ** 2, axis=1) for k in _KINDS], axis=1) / sigmas**2
    unsure = np.stack([np.sum(variance[:, k], axis=1) for k in _KINDS], axis=1) / sigmas**2
    decided = np.maximum(3.0 - unsure, 0.0)
    decided[resting[observed.picture]] = 0.0
    counts = decided.sum(axis=0)
    free = ~resting[observed.picture]
    factor = squares[free].sum(axis=0) / np.where(counts > 0, counts, 1.0)
    size = len(observed.pictures)
    by_picture = np.bincount(
        observed.picture, (squares / np.maximum(factor, 1e-12)).sum(axis=1), size
    )
    of_picture = np.bincount(observed.picture, decided.sum(axis=1), size)
    scale = np.sqrt((FREEDOM + by_picture * motion.picture_scale**2) / (FREEDOM + of_picture))
    return Motion(
        motion.sigma * np.sqrt(factor), np.where(resting, 0.0, scale), float(counts.sum())
    )


def _pose_grams(observed: Observations, linear: Linearised, weight: Float) -> Float:
    """(S, 6, C + 7) products, weighted, of a sighting's pose columns with all and the residual."""
    used = weight > 0
    residual = np.where(used[:, None], linear.residual_px, 0.0)
    full = np.concatenate([linear.jacobian, residual[:, :, None]], axis=2)
    pose = linear.jacobian[:, :, -POSE:] * np.where(used, weight, 0.0)[:, None, None]
    return np.add.reduceat(np.einsum("mai,maj->mij", pose, full), observed.start[:-1], axis=0)


def _through(problem: Problem, reduced: Reduced, inverse: Float, columns: Float) -> Float:
    """(S, 6, 6) covariance of steps of shared unknowns and boards, seen through columns.

    Args:
        problem: the solve.
        reduced: its normal equations.
        inverse: (P, P) covariance of the shared unknowns.
        columns: (S, 6, C + 7) by local columns and pose; the last is not used.
    """
    observed, layout = problem.observed, problem.layout
    place = layout.sighting_columns[observed.view]
    local = place.shape[1]
    by_shared = np.zeros((len(place), POSE, layout.count + 1))  # index -1: fixed
    np.put_along_axis(
        by_shared, np.repeat(place[:, None] % (layout.count + 1), POSE, 1), columns[:, :, :local], 2
    )
    by_pose = columns[:, :, local : local + POSE]
    half = np.linalg.solve(np.tril(reduced.pose)[observed.picture], np.swapaxes(by_pose, 1, 2))
    total = by_shared[:, :, :-1]
    total = total - np.einsum("ski,skp->sip", half, reduced.between[observed.picture])
    by_others = np.einsum("sip,sjp->sij", np.einsum("sip,pq->siq", total, inverse), total)
    return np.einsum("ski,skj->sij", half, half) + by_others
