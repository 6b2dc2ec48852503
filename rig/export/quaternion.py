"""Rotations as unit quaternions (x, y, z, w), of the same sense as their matrices.

Written here in a few lines, so that reading a small file does not load all of SciPy.
"""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float


def matrix_of(xyzw: Sequence[float]) -> Float:
    """Return the (3, 3) rotation of a quaternion of any length but 0."""
    x, y, z, w = np.asarray(xyzw, np.float64) / np.linalg.norm(xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(rotation: Float) -> list[float]:
    """Return the unit quaternion of a (3, 3) rotation whose w is not negative.

    S. W. Shepperd, "Quaternion from rotation matrix", Journal of Guidance and Control 1(3), 1978:
    the largest of the four is taken by a root, the others by division.
    """
    r = np.asarray(rotation, np.float64)
    squares = np.array([r[0, 0], r[1, 1], r[2, 2], np.trace(r)]) * 2.0 + 1.0 - np.trace(r)
    products = np.array(
        [
            [squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
        ]
    )
    row = products[int(np.argmax(squares))]
    unit = row / np.linalg.norm(row)
    return (unit if unit[3] >= 0.0 else -unit).tolist()
