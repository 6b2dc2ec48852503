"""From sightings to a calibration: a pure function of what was found."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.calibrate.sight import PictureSightings, all_sightings
from rig.errors import CalibrationError
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.solve import Fixed
from rig.geometry.half_turn import agree_on_turns
from rig.geometry.lens import LensModel
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile
from rig.targets import Target


@dataclass(frozen=True, slots=True)
class SolveChoices:
    """How to solve."""

    lens: LensModel | Literal["auto"] = "auto"
    start: RigGeometry | None = None
    """Geometry to start from."""
    fixed: Fixed = "none"
    """What of it to keep."""


def solve(
    profile: Profile, target: Target, pictures: Sequence[PictureSightings], choices: SolveChoices
) -> Calibration:
    """Solve cameras, their places, the target and the stage from all pictures.

    The same pictures give the same calibration to the last digit.

    Args:
        profile: the rig.
        target: what was looked for.
        pictures: pictures and what was found in them.
        choices: how to solve.

    Raises:
        CalibrationError: the pictures do not determine the geometry.
    """
    names = tuple(view.name for view in profile.views)
    sightings = all_sightings(pictures)
    if not sightings:
        raise CalibrationError(
            f"calibration of {profile.name} asked for, the target is in none of {len(pictures)} "
            "pictures",
            advice="show the target to the cameras",
        )
    sizes_px = pictures[0].sizes_px
    points_mm = target.points_mm.reshape(-1, 3)
    if not target.has_one_way_up:
        sightings = list(agree_on_turns(sightings, points_mm, sizes_px, names))
    stage_mm = {
        one.number: one.stage_mm for one in pictures if one.stage_mm is not None and one.sightings
    }
    return solve_rig(
        sightings,
        points_mm,
        sizes_px,
        names,
        profile.reference,
        stage_mm=stage_mm or None,
        lens=choices.lens,
        start=choices.start,
        fixed=choices.fixed,
        steps=np.array([[view.x_steps, view.y_steps] for view in profile.views]),
    )
