"""From points of the board to pixels, and the chain rule back: compiled, for whole sightings."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.geometry.lens_points import brown_at, brown_by_lens, fisheye_at, fisheye_by_lens

Int = NDArray[np.int64]


class Imaging(NamedTuple):
    """What takes P points of the board to M pixels in S sightings of V views."""

    points_mm: Float
    """(P, 3) of the bent board."""
    bending: Float
    """(P, 3) X^2, X Y, Y^2 of each point."""
    ids: Int
    """(M,) which of the points."""
    start: Int
    """(S + 1,) first of each sighting."""
    seen_by: Int
    """(S,) index of the view."""
    board_rotation: Float
    """(S, 3, 3) reference_from_board."""
    board_shift_mm: Float
    """(S, 3)."""
    view_rotation: Float
    """(V, 3, 3) cam_from_reference."""
    view_shift_mm: Float
    """(V, 3)."""
    numbers: Float
    """(V, 4 + 8) fx, fy, cx, cy and lens coefficients, filled up with zeros."""
    is_fisheye: NDArray[np.bool_]
    """(V,) Brown's lens otherwise."""
    coefficients: Int
    """(V,) how many a view's lens has."""


@kernel()
def project(imaging: Imaging, xy_px: Float, first: int, last: int, residual: Float) -> None:
    """Write found minus projected; infinite where the point is not before the camera.

    Args:
        imaging: the way to the pixels.
        xy_px: (M, 2) found.
        first: sighting to begin with.
        last: sighting to stop before.
        residual: (M, 2), written.
    """
    turned, swung = np.empty(3), np.empty(3)
    for s in range(first, last):
        v = imaging.seen_by[s]
        numbers = imaging.numbers[v]
        for m in range(imaging.start[s], imaging.start[s + 1]):
            depth = _reach(imaging, s, m, turned, swung)
            if not depth > 0.0:
                residual[m, 0] = residual[m, 1] = np.inf
                continue
            x = (swung[0] + imaging.view_shift_mm[v, 0]) / depth
            y = (swung[1] + imaging.view_shift_mm[v, 1]) / depth
            if imaging.is_fisheye[v]:
                bent = fisheye_at(numbers[4:], x, y)
            else:
                bent = brown_at(numbers[4:], x, y)
            residual[m, 0] = xy_px[m, 0] - (bent[0] * numbers[0] + numbers[2])
            residual[m, 1] = xy_px[m, 1] - (bent[1] * numbers[1] + numbers[3])


@kernel()
def differentiate(
    imaging: Imaging,
    xy_px: Float,
    longest: int,
    first: int,
    last: int,
    rows: Float,
    residual: Float,
) -> None:
    """Write residuals, and derivatives of the projections, of some sightings.

    Args:
        imaging: the way to the pixels.
        xy_px: (M, 2) found.
        longest: most lens coefficients of any view.
        first: sighting to begin with.
        last: sighting to stop before.
        rows: (M, 2, 4 + longest + 6 + 3 + 6), written: by intrinsics, turn and shift of the view,
            bending, turn and shift of the board.
        residual: (M, 2), written.
    """
    place = 4 + longest
    warp = place + 6
    pose = warp + 3
    turned, swung, by_point, by_inner = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for s in range(first, last):
        v = imaging.seen_by[s]
        numbers, count = imaging.numbers[v], imaging.coefficients[v]
        view_rotation, board_rotation = imaging.view_rotation[v], imaging.board_rotation[s]
        for m in range(imaging.start[s], imaging.start[s + 1]):
            depth = _reach(imaging, s, m, turned, swung)
            ahead = depth > 0.0
            depth = depth if ahead else 1.0
            x = (swung[0] + imaging.view_shift_mm[v, 0]) / depth
            y = (swung[1] + imaging.view_shift_mm[v, 1]) / depth
            by = rows[m]
            by[:, :place] = 0.0
            lens_x, lens_y = by[0, 4 : 4 + count], by[1, 4 : 4 + count]
            if imaging.is_fisheye[v]:
                bent = fisheye_at(numbers[4:], x, y)
                fisheye_by_lens(x, y, bent[5], bent[6], lens_x, lens_y)
            else:
                bent = brown_at(numbers[4:], x, y)
                brown_by_lens(x, y, bent[5], bent[6], lens_x, lens_y)
            for axis in range(2):
                focal, row = numbers[axis], by[axis]
                found = xy_px[m, axis] - (bent[axis] * focal + numbers[2 + axis])
                residual[m, axis] = found if ahead else np.inf
                row[axis] = bent[axis]
                row[2 + axis] = 1.0
                for i in range(count):
                    row[4 + i] *= focal
                scale = focal / depth
                by_point[0] = scale * bent[2 + axis]
                by_point[1] = scale * bent[3 + axis]
                by_point[2] = -(by_point[0] * x + by_point[1] * y)
                _by_motion(row[place:warp], by_point, swung)
                height = 0.0
                for j in range(3):
                    by_inner[j] = (
                        by_point[0] * view_rotation[0, j]
                        + by_point[1] * view_rotation[1, j]
                        + by_point[2] * view_rotation[2, j]
                    )
                    height += by_inner[j] * board_rotation[j, 2]
                for j in range(3):
                    row[warp + j] = height * imaging.bending[imaging.ids[m], j]
                _by_motion(row[pose:], by_inner, turned)


@kernel()
def _reach(imaging: Imaging, s: int, m: int, turned: Float, swung: Float) -> float:
    """Carry a point to its view: turned into the reference frame, swung into the view's; depth."""
    point = imaging.points_mm[imaging.ids[m]]
    board, view = imaging.board_rotation[s], imaging.view_rotation[imaging.seen_by[s]]
    shift = imaging.board_shift_mm[s]
    for i in range(3):
        turned[i] = board[i, 0] * point[0] + board[i, 1] * point[1] + board[i, 2] * point[2]
    for i in range(3):
        swung[i] = (
            view[i, 0] * (turned[0] + shift[0])
            + view[i, 1] * (turned[1] + shift[1])
            + view[i, 2] * (turned[2] + shift[2])
        )
    return swung[2] + imaging.view_shift_mm[imaging.seen_by[s], 2]


@kernel()
def _by_motion(row: Float, by_point: Float, point: Float) -> None:
    """Derivative (6,) by a turn and a shift of a point: the turn w moves it by w x point."""
    row[0] = point[1] * by_point[2] - point[2] * by_point[1]
    row[1] = point[2] * by_point[0] - point[0] * by_point[2]
    row[2] = point[0] * by_point[1] - point[1] * by_point[0]
    row[3], row[4], row[5] = by_point[0], by_point[1], by_point[2]
