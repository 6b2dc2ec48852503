"""Good, or weak and why."""

import numpy as np
from numpy.typing import NDArray

from rig.geometry.calibration.adjust import Adjusted
from rig.geometry.calibration.result import Verdict
from rig.geometry.calibration.uncertainty import Uncertainty
from rig.geometry.rig_geometry import RigGeometry


def judge(
    adjusted: Adjusted,
    uncertainty: Uncertainty,
    geometry: RigGeometry,
    steps: NDArray[np.float64] | None,
) -> Verdict:
    """Judge."""
    return Verdict((), (), ())
