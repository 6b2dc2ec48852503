"""All cameras, their places, the board and the stage in one solve."""

from rig.geometry.bundle.result import Calibration
from rig.geometry.bundle.solve import solve_rig

__all__ = ["Calibration", "solve_rig"]
