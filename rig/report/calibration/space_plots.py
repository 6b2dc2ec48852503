"""Where cameras and boards stood: seen from the cameras, and seen from the board."""

from typing import Any

import numpy as np

from rig.arrays import Float
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.report.calibration.shown import ShownCalibration
from rig.report.figures import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    VERMILLION,
    WIDTH_IN,
    Figure,
    draw_svg,
)

_COLOURS = (VERMILLION, BLUE, GREEN, ORANGE, PURPLE)
_PYRAMID_SHARE = 0.12
"""Length of the drawn cameras, as a share of the mean distance of the boards."""


def space_figure(shown: ShownCalibration) -> str:
    """Left: boards in the frame of the reference camera. Right: cameras in the board's frame."""
    calibration = shown.calibration
    geometry = calibration.geometry
    outline = _outline(calibration.points_mm)
    boards = [pose.apply(outline) for pose in calibration.reference_from_board]
    away_mm = float(np.mean([board[:, 2].mean() for board in boards]))
    pyramids = [
        pose.inverse().apply(_pyramid(camera, _PYRAMID_SHARE * away_mm))
        for camera, pose in zip(geometry.cameras, geometry.cam_from_reference, strict=True)
    ]

    def draw(figure: Figure) -> None:
        left = figure.add_axes((0.0, 0.06, 0.46, 0.86), projection="3d")
        right = figure.add_axes((0.5, 0.06, 0.46, 0.86), projection="3d")
        for board in boards:
            _line(left, board, color=BLACK, lw=0.5, alpha=0.6)
        for view, pyramid in enumerate(pyramids):
            _line(left, pyramid, color=_COLOURS[view % 5], lw=1.0)
        _line(right, outline, color=BLACK, lw=1.0)
        for pose in calibration.reference_from_board:
            back: Pose = pose.inverse()
            for view, pyramid in enumerate(pyramids):
                _line(right, back.apply(pyramid), color=_COLOURS[view % 5], lw=0.5, alpha=0.7)
        for axes, title in ((left, "boards, seen by the rig"), (right, "rig, seen by the board")):
            axes.set_title(title)
            _finish(axes)

    return draw_svg("space", "Cameras and boards in space", WIDTH_IN * 0.46, draw)


def _outline(points_mm: Float) -> Float:
    """(5, 3) closed rectangle around a flat board's points."""
    (x0, y0), (x1, y1) = points_mm[:, :2].min(axis=0), points_mm[:, :2].max(axis=0)
    return np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0], [x0, y0, 0]], np.float64)


def _pyramid(camera: CameraModel, length_mm: float) -> Float:
    """One line (N, 3) along the edges of a camera's field of view, in its own frame."""
    right, below = camera.width_px - 0.5, camera.height_px - 0.5
    corners = np.array([[-0.5, -0.5], [right, -0.5], [right, below], [-0.5, below]])
    # The ideal pinhole: lenses have no inverse outside of the picture's reach.
    rays = np.ones((4, 3))
    rays[:, :2] = (corners - (camera.cx_px, camera.cy_px)) / (camera.fx_px, camera.fy_px)
    a, b, c, d = length_mm * rays
    apex = np.zeros(3)
    return np.stack([apex, a, b, apex, c, b, c, d, apex, a, d])


def _line(axes: Any, points: Float, **style: Any) -> None:
    """Draw a line with z, the depth, running into the picture and y downwards."""
    axes.plot(points[:, 0], points[:, 2], -points[:, 1], **style)


def _finish(axes: Any) -> None:
    axes.set(xlabel="x mm", ylabel="z mm", zlabel="-y mm")
    axes.tick_params(labelsize=6.0, pad=-2)
    axes.xaxis.labelpad = axes.yaxis.labelpad = axes.zaxis.labelpad = -4
    axes.view_init(elev=22.0, azim=-62.0)
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
