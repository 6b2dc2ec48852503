"""Parts of a picture that the headline is told of: where boards were seen, where light falls."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.observations import Observations

COLUMNS, ROWS = 17, 13
"""Nodes of a grid over a whole picture, its corners among them."""

Part = NDArray[np.bool_]
"""(ROWS, COLUMNS) which nodes belong to it."""


def nodes_px(size_px: tuple[int, int]) -> Float:
    """(ROWS, COLUMNS, 2) pixels of the nodes."""
    width_px, height_px = size_px
    x, y = np.meshgrid(np.linspace(0, width_px - 1, COLUMNS), np.linspace(0, height_px - 1, ROWS))
    return np.stack([x, y], axis=-1)


def part_with_boards(
    observed: Observations, view: int, size_px: tuple[int, int], used: NDArray[np.bool_]
) -> Part:
    """Nodes that lie inside what a picture of a view showed of the board.

    Args:
        observed: M points.
        view: index.
        size_px: its width and height.
        used: (M,) points that took part in the solve.
    """
    own = map(observed.points, np.flatnonzero(observed.view == view).tolist())
    return part_of_sightings([observed.xy_px[rows][used[rows]] for rows in own], size_px)


def part_of_sightings(sightings: Sequence[Float], size_px: tuple[int, int]) -> Part:
    """Nodes that lie inside what was seen of the board.

    Args:
        sightings: (N, 2) px each, points of one picture of a view.
        size_px: width and height of its pictures.
    """
    nodes = nodes_px(size_px).reshape(-1, 2)
    inside = np.zeros(len(nodes), np.bool_)
    for points_px in sightings:
        xy_px = points_px.astype(np.float32)
        if len(xy_px) > 2:
            hull = cv2.convexHull(xy_px)
            low, high = hull.min(axis=(0, 1)), hull.max(axis=(0, 1))
            near = ~inside & ((nodes >= low) & (nodes <= high)).all(axis=1)
            for node in np.flatnonzero(near).tolist():
                x, y = nodes[node].tolist()
                inside[node] = cv2.pointPolygonTest(hull, (x, y), measureDist=False) >= 0
            middle_px = xy_px.mean(axis=0)  # of a board between the nodes
            inside[np.linalg.norm(nodes - middle_px, axis=1).argmin()] = True
    return inside.reshape(ROWS, COLUMNS)
