"""All cameras, their places, the board and the stage in one solve."""

from rig.geometry.bundle.calibrate import calibrate
from rig.geometry.bundle.result import Calibration

__all__ = ["Calibration", "calibrate"]
