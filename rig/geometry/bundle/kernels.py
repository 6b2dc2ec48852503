"""Sums of the normal equations, in one fixed order: the same bits whatever the thread count."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel

Int = NDArray[np.int64]

POSE = 6
"""Unknowns of a pose: the last columns of every local block."""


class Sightings(NamedTuple):
    """M points in S sightings, as they are summed."""

    jacobian: Float
    """(M, 2, C + 6); the last six columns belong to the board's pose."""
    residual: Float
    """(M, 2)."""
    weight: Float
    """(M,) inverse variances."""
    start: Int
    """(S + 1,) first point of each sighting."""
    picture: Int
    """(S,) never falling."""
    seen_by: Int
    """(S,) index of the view."""


class Sums(NamedTuple):
    """Blocks of N pictures and P shared unknowns."""

    shared: Float
    """(N, P, P)."""
    side: Float
    """(N, P) its right side."""
    between: Float
    """(N, 6, P)."""
    pose: Float
    """(N, 6, 6)."""
    pull: Float
    """(N, 6) its right side."""
    follow: Float
    """(S, 6, C + 7) how the motion of each sighting follows, see `_loosen`; S = 0 without ties."""

    @classmethod
    def none_yet(cls, pictures: int, count: int, ties: int, width: int) -> "Sums":
        """Zeros, for so many pictures, shared unknowns, sightings with ties, columns of a row."""
        return cls(
            np.zeros((pictures, count, count)),
            np.zeros((pictures, count)),
            np.zeros((pictures, POSE, count)),
            np.zeros((pictures, POSE, POSE)),
            np.zeros((pictures, POSE)),
            np.zeros((ties, POSE, width + 1)),
        )


@kernel()
def accumulate(
    sightings: Sightings, columns: Int, tie: Float, motion: Float, first: int, last: int, sums: Sums
) -> None:
    """Sum J^T W J and J^T W r of some sightings into blocks of their pictures.

    The normal matrix is an arrow: [S B^T; B A], where S holds what pictures share (cameras, board)
    and A is block diagonal, a pose of 6 to each picture. A sighting touches the local columns of
    its own camera only, and `columns` says where among the shared ones they belong.

    Args:
        sightings: what is summed.
        columns: (V, C) place of the local columns among the shared unknowns, -1 fixed.
        tie: (S, 6, 6) information that ties each sighting's own pose to its picture's; (0, 6, 6)
            where a picture has one pose.
        motion: (S, 6) from the picture's pose to that of each sighting; (0, 6) likewise.
        first: sighting to begin with; all of a picture are summed in one call.
        last: sighting to stop before.
        sums: added to.
    """
    width = sightings.jacobian.shape[2]
    local = width - POSE
    gram = np.zeros((width, width))
    pulled = np.zeros(width)
    start = sightings.start
    for s in range(first, last):
        rows = slice(start[s], start[s + 1])
        _sum_points(
            sightings.jacobian[rows], sightings.residual[rows], sightings.weight[rows], gram, pulled
        )
        if tie.shape[0] > 0:
            _loosen(gram, pulled, tie[s], motion[s], sums.follow[s])
        n, place = sightings.picture[s], columns[sightings.seen_by[s]]
        _add_block(gram, place, sums.shared[n], sums.between[n])
        for i in range(local):
            if place[i] >= 0:
                sums.side[n, place[i]] += pulled[i]
        sums.pull[n] += pulled[local:]
        sums.pose[n] += gram[local:, local:]


@kernel()
def _loosen(gram: Float, pulled: Float, tie: Float, motion: Float, follow: Float) -> None:
    """Eliminate a sighting's motion m, which `tie` holds near zero.

    With H the block of the pose, the motion that fits best is m = F [0..0, 1] - F [shared, pose, 0]
    for steps of the shared unknowns and of the picture's pose. What it takes away is the gram seen
    through (H + tie)^-1: all of the pose's block where nothing ties, nothing where the tie is firm.

    Args:
        gram: (C + 6, C + 6) of one sighting, replaced.
        pulled: (C + 6,), replaced.
        tie: (6, 6).
        motion: (6,) where the gram was taken.
        follow: (6, C + 7) set to F = (H + tie)^-1 [gram of the pose, pulled at rest].
    """
    width = pulled.size
    local = width - POSE
    for i in range(width):
        for j in range(POSE):
            pulled[i] += gram[i, local + j] * motion[j]
    for i in range(POSE):
        follow[i, :width] = gram[local + i]
        follow[i, width] = pulled[local + i]
    factor = gram[local:, local:] + tie
    factorise(factor)
    solve_factorised(factor, follow)
    side = gram[:, local:].copy()
    for i in range(width):
        for k in range(POSE):
            pulled[i] -= side[i, k] * follow[k, width]
            for j in range(width):
                gram[i, j] -= side[i, k] * follow[k, j]


@kernel()
def _sum_points(
    jacobian: Float, residual: Float, weight: Float, gram: Float, pulled: Float
) -> None:
    """Set gram to J^T W J and pulled to J^T W r of one sighting.

    Two points at a time: the sums are then read and written half as often.
    """
    width = gram.shape[0]
    gram[:] = 0.0
    pulled[:] = 0.0
    used = np.flatnonzero(weight)
    for at in range(0, used.size, 2):
        m = used[at]
        last = at + 1 == used.size
        n = m if last else used[at + 1]
        own, other = weight[m], 0.0 if last else weight[n]
        a, b, c, d = jacobian[m, 0], jacobian[m, 1], jacobian[n, 0], jacobian[n, 1]
        for i in range(width):
            p, q, r, t = own * a[i], own * b[i], other * c[i], other * d[i]
            pulled[i] += p * residual[m, 0] + q * residual[m, 1]
            pulled[i] += r * residual[n, 0] + t * residual[n, 1]
            row = gram[i]
            for j in range(i + 1):
                row[j] += (p * a[j] + q * b[j]) + (r * c[j] + t * d[j])
    for i in range(width):
        for j in range(i):
            gram[j, i] = gram[i, j]


@kernel()
def _add_block(gram: Float, place: Int, shared: Float, between: Float) -> None:
    """Add the columns of one sighting that move to where they belong among the shared ones."""
    local = place.size
    for i in range(local):
        a = place[i]
        if a < 0:
            continue
        for j in range(local):
            if place[j] >= 0:
                shared[a, place[j]] += gram[i, j]
        for j in range(POSE):
            between[j, a] += gram[i, local + j]


@kernel()
def eliminate(pose: Float, pull: Float, between: Float, damping: float) -> bool:
    """Replace, picture by picture, pose A = L L^T by L, pull by L^-1 pull, between by L^-1 between.

    The Schur complement S - B^T A^-1 B of the poses is then S minus the gram of the new `between`.

    Args:
        pose: (N, 6, 6); its diagonal is multiplied by 1 + damping first.
        pull: (N, 6).
        between: (N, 6, P).
        damping: of Levenberg and Marquardt.

    Returns:
        Whether every block was positive definite.
    """
    for n in range(pull.shape[0]):
        for i in range(POSE):
            pose[n, i, i] *= 1.0 + damping
        if not factorise(pose[n]):
            return False
        for i in range(POSE):
            for k in range(i):
                pull[n, i] -= pose[n, i, k] * pull[n, k]
                for p in range(between.shape[2]):
                    between[n, i, p] -= pose[n, i, k] * between[n, k, p]
            pull[n, i] /= pose[n, i, i]
            for p in range(between.shape[2]):
                between[n, i, p] /= pose[n, i, i]
    return True


@kernel()
def subtract_gram(matrix: Float, rows: Float) -> None:
    """Subtract rows^T rows, of (K, P), from a matrix (P, P)."""
    for k in range(rows.shape[0]):
        for i in range(rows.shape[1]):
            value = rows[k, i]
            if value != 0.0:
                for j in range(rows.shape[1]):
                    matrix[i, j] -= value * rows[k, j]


@kernel()
def factorise(matrix: Float) -> bool:
    """Cholesky: lower triangle of (P, P) becomes L; False at a pivot that is not positive."""
    size = matrix.shape[0]
    for j in range(size):
        for k in range(j):
            factor = matrix[j, k]
            for i in range(j, size):
                matrix[i, j] -= matrix[i, k] * factor
        if not matrix[j, j] > 0.0:
            return False
        root = np.sqrt(matrix[j, j])
        for i in range(j, size):
            matrix[i, j] /= root
    return True


@kernel()
def solve_factorised(factor: Float, sides: Float) -> None:
    """Replace sides (P, K) by A^-1 sides, where A = L L^T and L the lower triangle of `factor`."""
    size = factor.shape[0]
    for i in range(size):
        for k in range(i):
            for c in range(sides.shape[1]):
                sides[i, c] -= factor[i, k] * sides[k, c]
        for c in range(sides.shape[1]):
            sides[i, c] /= factor[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            for c in range(sides.shape[1]):
                sides[i, c] -= factor[k, i] * sides[k, c]
        for c in range(sides.shape[1]):
            sides[i, c] /= factor[i, i]
