"""All cameras, their places, the board and the stage in one solve."""

from rig.geometry.calibration.calibrate import calibrate
from rig.geometry.calibration.result import Calibration

__all__ = ["Calibration", "calibrate"]
