"""Flat targets that cameras are calibrated with, and one door that finds any of them."""

from rig.targets.aprilgrid.board import AprilGrid
from rig.targets.charuco.board import CharucoBoard
from rig.targets.circles.grid import CircleGrid
from rig.targets.detection import Detection
from rig.targets.find import (
    CornersOrReason,
    Target,
    corners_or_reason,
    find_target,
    full_corners,
)

__all__ = [
    "AprilGrid",
    "CharucoBoard",
    "CircleGrid",
    "CornersOrReason",
    "Detection",
    "Target",
    "corners_or_reason",
    "find_target",
    "full_corners",
]
