"""The chain rule from a point on the board to its pixel, for every point of one view."""

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel


@kernel()
def chain(
    jacobian: Float,
    rows: NDArray[np.int64],
    intrinsics: Float,
    bent: Float,
    bent_by_xy: Float,
    bent_by_lens: Float,
    xy: Float,
    depth_mm: Float,
    swung_mm: Float,
    turned_mm: Float,
    view_rotation: Float,
    board_rotation: Float,
    bending: Float,
    longest: int,
) -> None:
    """Write rows of the Jacobian, K points of one view.

    Args:
        jacobian: (M, 2, 4 + longest + 6 + 3 + 6), written at `rows`: intrinsics, turn and shift of
            the view, bending, turn and shift of the board.
        rows: (K,).
        intrinsics: (4 + L,) fx, fy, cx, cy and lens coefficients.
        bent: (K, 2) distorted normalised coordinates.
        bent_by_xy: (K, 2, 2).
        bent_by_lens: (K, 2, L).
        xy: (K, 2) ideal normalised coordinates.
        depth_mm: (K,) along the view's optical axis.
        swung_mm: (K, 3) points turned, not yet shifted, into the view's frame.
        turned_mm: (K, 3) points turned, not yet shifted, into the reference frame.
        view_rotation: (3, 3) cam_from_reference.
        board_rotation: (K, 3, 3) reference_from_board of each point.
        bending: (K, 3) X^2, X Y, Y^2 of each point.
        longest: most lens coefficients of any view.
    """
    own = bent_by_lens.shape[2]
    place = 4 + longest
    warp = place + 6
    pose = warp + 3
    by_point = np.empty(3)
    by_inner = np.empty(3)
    for k in range(rows.size):
        for axis in range(2):
            focal = intrinsics[axis]
            row = jacobian[rows[k], axis]
            row[:place] = 0.0
            row[axis] = bent[k, axis]
            row[2 + axis] = 1.0
            for i in range(own):
                row[4 + i] = focal * bent_by_lens[k, axis, i]
            scale = focal / depth_mm[k]
            by_point[0] = scale * bent_by_xy[k, axis, 0]
            by_point[1] = scale * bent_by_xy[k, axis, 1]
            by_point[2] = -(by_point[0] * xy[k, 0] + by_point[1] * xy[k, 1])
            _by_motion(row[place:warp], by_point, swung_mm[k])
            for j in range(3):
                by_inner[j] = (
                    by_point[0] * view_rotation[0, j]
                    + by_point[1] * view_rotation[1, j]
                    + by_point[2] * view_rotation[2, j]
                )
            height = 0.0
            for j in range(3):
                height += by_inner[j] * board_rotation[k, j, 2]
            for j in range(3):
                row[warp + j] = height * bending[k, j]
            _by_motion(row[pose:], by_inner, turned_mm[k])


@kernel()
def _by_motion(row: Float, by_point: Float, point: Float) -> None:
    """Derivative (6,) by a turn and a shift of a point: the turn w moves it by w x point."""
    row[0] = point[1] * by_point[2] - point[2] * by_point[1]
    row[1] = point[2] * by_point[0] - point[0] * by_point[2]
    row[2] = point[0] * by_point[1] - point[1] * by_point[0]
    row[3], row[4], row[5] = by_point[0], by_point[1], by_point[2]
