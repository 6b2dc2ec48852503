"""The projective map of a plane: board to picture."""

import cv2
import numpy as np

from rig.arrays import Float


def grid_places(rows: int, columns: int) -> Float:
    """(rows, columns, 2) places (column, row) of a regular grid."""
    row, column = np.mgrid[0:rows, 0:columns].astype(np.float64)
    return np.stack([column, row], axis=-1)


def fit_homography(source: Float, target: Float) -> Float:
    """(3, 3) least-squares homography between two sets of (N, 2) points, N >= 4."""
    homography, _ = cv2.findHomography(source, target)
    return np.asarray(homography, np.float64)


def map_points(homography: Float, points: Float) -> Float:
    """Map (..., 2) points."""
    mapped = points @ homography[:, :2].T + homography[:, 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:], np.float64)
