"""First guess of a camera from flat boards: focal length, and a pose per picture.

Z. Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 22(11), 2000, gets the
focal length of a pinhole from homographies in closed form. Here it is scanned instead: the same
few lines then serve a fisheye, and boards that are all square-on give a poor start, no nonsense.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.rotations import nearest_rotation
from rig.geometry.camera_model import CameraModel
from rig.geometry.homography import fit_homography
from rig.geometry.lens import COEFFICIENTS, LensModel
from rig.geometry.pose import Pose

_SCAN = np.geomspace(0.25, 5.0, 11)
"""Focal lengths tried, in picture widths: fields of view from 127 to 11 degrees. The solve goes on
from one that is off by a third, and 11 leave a sixth."""
_MOST_SCANNED = 6
_WORST_SHARE = 0.05
"""A board off by more than this share of the width says only that the guess is wrong."""


@dataclass(frozen=True, slots=True)
class BoardPoints:
    """One board in one view."""

    plane_mm: Float
    """(N, 2) points on the board."""
    xy_px: Float
    """(N, 2)."""


@dataclass(frozen=True, slots=True)
class CameraStart:
    """A first guess of one view."""

    camera: CameraModel
    misfit_px: float
    """Mean over boards of their rms distance, capped."""


def guess_camera(
    boards: Sequence[BoardPoints], size_px: tuple[int, int], lens: LensModel
) -> CameraStart:
    """Scan focal lengths, principal point in the middle, without lens coefficients.

    Args:
        boards: boards in this view.
        size_px: (width, height).
        lens: `fisheye` scans an equidistant projection, every other model a pinhole.
    """
    some = [
        boards[i]
        for i in np.linspace(0, len(boards) - 1, min(len(boards), _MOST_SCANNED)).astype(int)
    ]
    starts = [_judge(some, bare_camera(size_px, f * max(size_px), lens)) for f in _SCAN]
    return min(starts, key=lambda start: start.misfit_px)


def bare_camera(size_px: tuple[int, int], focal_px: float, lens: LensModel) -> CameraModel:
    """Return a camera that looks straight, without distortion."""
    width, height = size_px
    return CameraModel(
        width, height, focal_px, focal_px, (width - 1) / 2, (height - 1) / 2,
        lens, (0.0,) * COEFFICIENTS[lens],
    )  # fmt: skip


def _judge(boards: Sequence[BoardPoints], camera: CameraModel) -> CameraStart:
    worst = _WORST_SHARE * camera.width_px
    misfit = [
        min(board_misfit(camera, board, board_pose(camera, board)), worst) for board in boards
    ]
    return CameraStart(camera, float(np.mean(misfit)))


def board_pose(camera: CameraModel, board: BoardPoints) -> Pose | None:
    """cam_from_board of one board, from its homography; None where the camera cannot show it."""
    xy = camera.unproject(board.xy_px)
    good = np.isfinite(xy).all(axis=1)
    if good.sum() < 4:
        return None
    matrix = fit_homography(board.plane_mm[good], xy[good])
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        return None
    length = (np.linalg.norm(matrix[:, 0]) + np.linalg.norm(matrix[:, 1])) / 2
    if not length > 0:
        return None
    middle = matrix @ [*board.plane_mm.mean(axis=0), 1.0]
    matrix = matrix / (length * np.sign(middle[2]))
    first, second, shift = matrix.T
    return Pose(nearest_rotation(np.stack([first, second, np.cross(first, second)], 1)), shift)


def board_misfit(camera: CameraModel, board: BoardPoints, pose: Pose | None) -> float:
    """Rms distance of a board's points from where a pose puts them, px; infinite for none."""
    if pose is None:
        return float("inf")
    points = np.concatenate([board.plane_mm, np.zeros((len(board.plane_mm), 1))], axis=1)
    apart = camera.project(pose.apply(points)) - board.xy_px
    square = float(np.mean(np.sum(apart**2, axis=1)))
    return float(np.sqrt(square)) if np.isfinite(square) else float("inf")
