"""One door for all targets: a picture and a target in, named corners out."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.errors import TargetError
from rig.targets.aprilgrid.board import AprilGrid
from rig.targets.aprilgrid.find import find_aprilgrid
from rig.targets.charuco.board import CharucoBoard
from rig.targets.charuco.find import find_charuco
from rig.targets.checkerboard import Checkerboard
from rig.targets.circles.find import find_circles
from rig.targets.circles.grid import CircleGrid
from rig.targets.corners import Corners, find_board, find_corners
from rig.targets.detection import Detection
from rig.targets.outliers import inliers
from rig.targets.pyramid import Image

Target: TypeAlias = Checkerboard | CharucoBoard | AprilGrid | CircleGrid
CornersOrReason: TypeAlias = Corners | TargetError
"""The board in one picture, or why it is not there."""


def find_target(image: Image, target: Target) -> Detection:
    """Find the points of a target to sub-pixel precision.

    Of a checkerboard a part will do where it is certain which part (see `find_board`), of a ChArUco
    board or an AprilGrid any part with six corners; a grid of circles must be all in view. Corners
    that do not lie where their neighbours put them are left out. Of circles these are the middles
    of their ellipses, see `rig.geometry.circle_bias`.

    Args:
        image: (H, W) grey; float32 in 8-bit grey levels.
        target: what to look for.

    Raises:
        TargetError: it is not there as asked for; `reason` says why in one word.
    """
    if not isinstance(target, Checkerboard):
        _check_picture(image, target)
        return _found(image, target)
    corners = find_board(image, target)
    kept = inliers(corners.xy_px, corners.sigma_px)
    return Detection(
        np.flatnonzero(kept),
        corners.xy_px[kept],
        corners.sigma_px[kept],
        corners.blur_px,
        corners.contrast,
    )


def _found(image: Image, target: CharucoBoard | AprilGrid | CircleGrid) -> Detection:
    match target:
        case CharucoBoard():
            return find_charuco(image, target)
        case AprilGrid():
            return find_aprilgrid(image, target)
        case CircleGrid():
            return find_circles(image, target)


def full_corners(image: Image, target: Target) -> Corners:
    """Find all inner corners of a target, for those who need the whole grid.

    Raises:
        TargetError: as `find_target`; reason clipped where a part is missing, no-squares of a
            target that has none.
        ConfigError: a ChArUco board of fewer than 3 x 3 inner corners.
    """
    if isinstance(target, Checkerboard):
        return find_corners(image, target)
    if not isinstance(target, CharucoBoard):
        raise TargetError(
            f"corners of squares asked for of a target without squares ({target})",
            advice="rig calibrate takes this target; sweep with a checkerboard or a ChArUco board",
            reason="no-squares",
        )
    board = target.as_checkerboard
    detection = find_target(image, target)
    if len(detection) < board.rows * board.columns:
        raise TargetError(
            f"all {board} inner corners of a ChArUco board asked for, found {len(detection)}",
            advice="move the board until all of it is in view, without glare",
            reason="clipped",
        )
    shape = (board.rows, board.columns)
    return Corners(
        board,
        detection.xy_px.reshape(*shape, 2),
        detection.sigma_px.reshape(shape),
        detection.blur_px,
        detection.contrast,
    )


def corners_or_reason(image: Image, target: Target) -> CornersOrReason:
    """Find all inner corners of a target, or return the reason why there are none."""
    try:
        return full_corners(image, target)
    except TargetError as error:
        return error


def _check_picture(image: Image, target: Target) -> None:
    if image.ndim != 2 or min(image.shape) < 16 or not _finite(image):
        raise TargetError(
            f"target {target} asked for in an array of shape {image.shape}",
            advice="give a grey picture (H, W) of at least 16 x 16 finite pixels",
            reason="not-found",
        )


def _finite(image: NDArray[np.generic]) -> bool:
    return image.dtype.kind != "f" or bool(np.isfinite(image).all())
