"""What is known before any picture: lenses are tame, boards nearly flat, stages nearly straight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.linearise import Target
from rig.geometry.bundle.rotations import turn_between
from rig.geometry.bundle.unknowns import POSE, STAGE, Layout, Unknowns
from rig.geometry.lens import COEFFICIENTS

Int = NDArray[np.int64]

LENS_SIGMA = 1.0
"""Of every lens coefficient about 0: says nothing where the pictures speak, and keeps a rational
lens, whose numerator and denominator can cancel, from running away."""
BENDING_SHARE = 0.005
"""Sigma of each bending term over half the board's longer side: 0.7 mm on a sheet of A4."""
STAGE_SHIFT_MM = 0.005
"""Sigma of where the stage puts the board, about its line, each axis."""
STAGE_TURN_RAD = 5e-5
"""Sigma of how it turns the board on the way, each axis."""


@dataclass(frozen=True, slots=True)
class StageStops:
    """Which pictures were taken on the stage."""

    picture: Int
    """(K,) index of the picture."""
    position_mm: Float
    """(K,) as the driver told it."""

    @property
    def middle_mm(self) -> float:
        """Position in the middle of the travel used."""
        return float(self.position_mm.min() + self.position_mm.max()) / 2


@dataclass(frozen=True, slots=True)
class Pull:
    """Normal equations of the priors alone; their residuals are wanted minus found."""

    information: Float
    """(P,) diagonal over the shared unknowns."""
    side: Float
    """(P,) its right side."""
    cost: float


def pull_of_shared(at: Unknowns, layout: Layout, target: Target) -> Pull:
    """Priors on lens coefficients and bending."""
    information, side = np.zeros(layout.count + 1), np.zeros(layout.count + 1)
    cost = 0.0
    for view, lens in enumerate(at.lenses):
        columns = layout.view_columns[view, 4 : 4 + COEFFICIENTS[lens]]
        values = at.intrinsics[view][4:]
        information[columns] += LENS_SIGMA**-2
        side[columns] -= values * LENS_SIGMA**-2
        cost += float(np.sum(values**2)) * LENS_SIGMA**-2
    inverse = (BENDING_SHARE * float(target.half_mm.max())) ** -2
    information[layout.warp_columns] += inverse
    side[layout.warp_columns] -= at.warp_mm * inverse
    cost += float(np.sum(at.warp_mm**2)) * inverse
    return Pull(information[:-1], side[:-1], cost)


@dataclass(frozen=True, slots=True)
class StageRows:
    """Residuals that tie K boards to the stage's line, in units of their sigma."""

    residual: Float
    """(K, 6) wanted minus found: turn, shift."""
    by_pose: Float
    """(6,) diagonal of the derivative of `found` by the board's pose."""
    by_stage: Float
    """(K, 6, 9)."""


def stage_rows(at: Unknowns, stops: StageStops) -> StageRows:
    """Compare boards with where the stage should have put them; derivatives to first order."""
    line = at.stage
    if line is None:
        raise AssertionError("stage rows without a stage")
    away_mm = stops.position_mm - line.middle_mm
    turn = turn_between(at.board_rotation[stops.picture], line.rotation)
    wanted = line.origin_mm + line.scale * away_mm[:, None] * line.axis
    shift = at.board_shift_mm[stops.picture] - wanted
    sigma = np.repeat([STAGE_TURN_RAD, STAGE_SHIFT_MM], 3)
    by_stage = np.zeros((len(away_mm), POSE, STAGE))
    by_stage[:, :3, :3] = by_stage[:, 3:, 3:6] = -np.eye(3)
    by_stage[:, 3:, 6:8] = -line.scale * away_mm[:, None, None] * line.across.T
    by_stage[:, 3:, 8] = -away_mm[:, None] * line.axis
    return StageRows(
        residual=-np.concatenate([turn, shift], axis=1) / sigma,
        by_pose=1.0 / sigma,
        by_stage=by_stage / sigma[:, None],
    )
