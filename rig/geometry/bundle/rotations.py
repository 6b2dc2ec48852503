"""Stacks of rotations and their small turns; arithmetic without BLAS, so that bits repeat."""

import numpy as np

from rig.arrays import Float

_SMALL_RAD = 1e-5
"""Below this angle the series is exact to double precision."""


def cross_matrix(vectors: Float) -> Float:
    """(..., 3, 3) matrices that take p to v x p, of (..., 3) vectors v."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = ((zero, -z, y), (z, zero, -x), (-y, x, zero))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def turns(vectors_rad: Float) -> Float:
    """(..., 3, 3) rotations of (..., 3) Rodrigues vectors."""
    angle = np.sqrt(np.sum(vectors_rad**2, axis=-1))[..., None, None]
    small = angle < _SMALL_RAD
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 1.0 - angle**2 / 6.0, np.sin(safe) / safe)
    second = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    cross = cross_matrix(vectors_rad)
    return np.eye(3) + first * cross + second * times(cross, cross)


def times(left: Float, right: Float) -> Float:
    """Products (..., 3, K) of stacks of (..., 3, 3) and (..., 3, K) matrices."""
    return np.einsum("...ij,...jk->...ik", left, right)


def apply(rotations: Float, points: Float) -> Float:
    """(..., 3) points turned by (..., 3, 3) rotations."""
    return np.einsum("...ij,...j->...i", rotations, points)


def rodrigues_by_turn(vector_rad: Float) -> Float:
    """(3, 3) how the Rodrigues vector of R moves when R becomes exp(w) R, by w.

    Inverse left Jacobian of SO(3): J. Solà, J. Deray, D. Atchuthan, "A micro Lie theory for state
    estimation in robotics", arXiv:1812.01537, 2018, eq. 146.
    """
    angle = float(np.sqrt(np.sum(vector_rad**2)))
    cross = cross_matrix(vector_rad)
    square = times(cross, cross)
    if angle < 1e-3:
        factor = 1.0 / 12.0 + angle**2 / 720.0
    else:
        factor = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    return np.eye(3) - 0.5 * cross + factor * square


def nearest_rotation(matrix: Float) -> Float:
    """(3, 3) rotation nearest to a matrix in the Frobenius norm."""
    left, _, right = np.linalg.svd(matrix)
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(left @ right)))])
    return left @ flip @ right


def turn_between(first: Float, second: Float) -> Float:
    """(..., 3) vectors w with first = exp(w) second, for turns below half a circle."""
    matrix = np.einsum("...ij,...kj->...ik", first, second)
    sine = 0.5 * np.stack(
        [
            matrix[..., 2, 1] - matrix[..., 1, 2],
            matrix[..., 0, 2] - matrix[..., 2, 0],
            matrix[..., 1, 0] - matrix[..., 0, 1],
        ],
        axis=-1,
    )
    size = np.sqrt(np.sum(sine**2, axis=-1))
    cosine = 0.5 * (matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2] - 1.0)
    angle = np.arctan2(size, cosine)
    factor = np.where(size < _SMALL_RAD, 1.0, angle / np.where(size < _SMALL_RAD, 1.0, size))
    return sine * factor[..., None]
