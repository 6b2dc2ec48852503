"""How well the pictures taken so far cover views, tilts and distances."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.calibrate.sight import PictureSightings, all_sightings
from rig.geometry.bundle.start_cameras import BoardPoints, board_pose, guess_camera
from rig.targets import Target

COLUMNS, ROWS = 5, 4
"""The grid in which the area of a picture is counted."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the target was seen in."""

    cells: NDArray[np.intp]
    """(V, ROWS, COLUMNS) corners seen in each part of each view's picture."""
    shared: NDArray[np.intp]
    """(V, V) pictures in which both views show the target."""
    tilts_deg: Float
    """(K, 2) tilt about x and y of the boards in the view that shows most of them."""
    distances_mm: Float
    """(K,) their distances, as good as a first guess of the focal length."""

    @property
    def area_share(self) -> Float:
        """(V,) share of the parts that have shown corners."""
        return (self.cells > 0).mean(axis=(1, 2))


def coverage_of(sightings: Sequence[PictureSightings], target: Target, view_count: int) -> Coverage:
    """Count what the pictures cover."""
    cells = np.zeros((view_count, ROWS, COLUMNS), np.intp)
    shared = np.zeros((view_count, view_count), np.intp)
    for one in sightings:
        shared[np.ix_(one.views, one.views)] += 1
        for sighting in one.sightings:
            width_px, height_px = one.sizes_px[sighting.view]
            column = (sighting.xy_px[:, 0] / width_px * COLUMNS).astype(np.intp)
            row = (sighting.xy_px[:, 1] / height_px * ROWS).astype(np.intp)
            place = np.clip(row, 0, ROWS - 1), np.clip(column, 0, COLUMNS - 1)
            np.add.at(cells[sighting.view], place, 1)
    tilts_deg, distances_mm = _poses(sightings, target, shared)
    return Coverage(cells, shared, tilts_deg, distances_mm)


def _poses(
    sightings: Sequence[PictureSightings], target: Target, shared: NDArray[np.intp]
) -> tuple[Float, Float]:
    view = int(np.diag(shared).argmax())
    points_mm = target.points_mm.reshape(-1, 3)
    boards = [
        BoardPoints(points_mm[s.ids, :2], s.xy_px)
        for s in all_sightings(sightings)
        if s.view == view
    ]
    if not boards:
        return np.empty((0, 2)), np.empty(0)
    camera = guess_camera(boards, sightings[0].sizes_px[view], "none").camera
    poses = [pose for pose in (board_pose(camera, board) for board in boards) if pose is not None]
    if not poses:
        return np.empty((0, 2)), np.empty(0)
    normals = np.stack([pose.rotation[:, 2] for pose in poses])
    # A board turned about x shows its normal up or down; about y, right or left.
    tilts_deg = np.degrees(np.arctan2(normals[:, [1, 0]] * (-1, 1), normals[:, [2]]))
    middle_mm = points_mm.mean(axis=0)
    return tilts_deg, np.array([float(pose.apply(middle_mm)[2]) for pose in poses])
