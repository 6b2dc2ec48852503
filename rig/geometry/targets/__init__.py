"""Flat targets that cameras are calibrated with, and one door that finds any of them."""

from rig.geometry.targets.charuco_board import CharucoBoard
from rig.geometry.targets.detection import Detection
from rig.geometry.targets.find import Target, find_target, full_corners

__all__ = ["CharucoBoard", "Detection", "Target", "find_target", "full_corners"]
