"""The entry point: from sightings of a board to the geometry of the rig."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.geometry.calibration.result import Calibration
from rig.geometry.lens import LensModel
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.sighting import Sighting

Float = NDArray[np.float64]
Fixed = Literal["none", "intrinsics", "all"]
"""What `start` holds still: nothing, the cameras' intrinsics, or the extrinsics as well."""


def calibrate(
    sightings: Sequence[Sighting],
    points_mm: Float,
    sizes_px: Sequence[tuple[int, int]],
    names: Sequence[str],
    reference: int,
    *,
    stage_mm: Mapping[int, float] | None = None,
    lens: LensModel | Literal["auto"] = "auto",
    start: RigGeometry | None = None,
    fixed: Fixed = "none",
    steps: Float | None = None,
) -> Calibration:
    """Solve cameras, their places, the board and the stage together.

    Args:
        sightings: what was found, at most one per picture and view, in any order.
        points_mm: (P, 3) points of the flat target, z = 0.
        sizes_px: (width, height) of each view.
        names: of each view, for messages.
        reference: index of the view whose frame all places are told in.
        stage_mm: driver position of the pictures in which the stage carried the board; these
            share one orientation of the board.
        lens: model of all views, or `auto` to choose by cross-validation over pictures.
        start: geometry to start from instead of one found from the sightings.
        fixed: what of `start` to hold still.
        steps: (V, 2) where the profile places the views, right and down, in any unit; only their
            directions are compared with what is found.

    Raises:
        CalibrationError: the sightings do not determine the geometry.
        ConfigError: arguments contradict each other.
    """
    raise NotImplementedError
