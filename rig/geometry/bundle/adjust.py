"""Robust bundle adjustment: weights and unknowns settle each other."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.bundle.linearise import Target, linearise, residuals_px
from rig.geometry.bundle.motion import Motion, measure_motion, notice_motion
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.priors import StageStops
from rig.geometry.bundle.scatter import Scatter, measure_scatter, point_weights
from rig.geometry.bundle.settle import Problem, settle
from rig.geometry.bundle.unknowns import POSE, Free, StageLine, Unknowns, lay_out

_MOST_ROUNDS = 12
_MOST_COARSE_ROUNDS = 3
_MOST_MOVING_ROUNDS = 40
_LAST_FLOOR = 3
"""Round after which floors stay: one of a few values, and what jumps does not settle."""
_STEPS_A_ROUND = 6
_COARSE_DAMPING, _FINE_DAMPING = 1e-4, 1e-8
_COARSE, _FINE = 0.1, 2e-3
"""Relative change of the scales between rounds below which they are taken as settled."""


@dataclass(frozen=True, slots=True)
class Adjusted:
    """Unknowns that settled, with the scatter that settled beside them."""

    problem: Problem
    at: Unknowns
    residual_px: Float
    """(M, 2)."""
    scatter: Scatter
    weight: Float
    """(M,) inverse variances; 0 for outliers."""
    motion: Motion | None = None
    """Of the board between views; None where they show it at rest."""


def adjust(
    observed: Observations,
    target: Target,
    start: Unknowns,
    reference: int,
    stops: StageStops | None,
    free: Free,
) -> Adjusted:
    """Solve everything that is free, from coarse to fine.

    First without bending and stage, and without rejecting anything, because far from the answer a
    good point looks like an outlier; then all of it.
    """
    coarse = replace(free, lens=False, warp=False)
    at = _rounds(observed, target, start, reference, None, coarse, reject=False).at
    at = _rounds(observed, target, at, reference, None, replace(free, warp=False), reject=False).at
    if stops is not None and at.stage is None:
        at = replace(at, stage=fit_line(at, stops))
    return readjust(observed, target, at, reference, stops, free)


def readjust(
    observed: Observations,
    target: Target,
    near: Unknowns,
    reference: int,
    stops: StageStops | None,
    free: Free,
) -> Adjusted:
    """Solve everything that is free from a start near the answer.

    Where views of one picture then disagree about the board by more than chance, the board moved
    between them, and the solve is done again with motions.
    """
    still = replace(near, motion=None)
    rested = _rounds(observed, target, still, reference, stops, free, reject=True)
    if not free.motion:
        return rested
    resting = np.zeros(len(observed.pictures), bool)
    if stops is not None:
        resting[stops.picture] = True
    linear = linearise(observed, target, rested.at)
    motion = notice_motion(rested.problem, rested.at, linear, rested.weight, resting)
    return rested if motion is None else _moving_rounds(rested, motion, resting)


def _moving_rounds(rested: Adjusted, motion: Motion, resting: NDArray[np.bool_]) -> Adjusted:
    """Let weights, motions and unknowns settle each other."""
    problem = rested.problem
    observed, target = problem.observed, problem.target
    at = replace(rested.at, motion=np.zeros((len(observed.view), POSE)))
    residual_px, scatter, weight = rested.residual_px, rested.scatter, rested.weight
    for turn in range(_MOST_MOVING_ROUNDS):
        before, was = scatter, motion
        problem = replace(problem, tie=motion.ties(at, target, observed))
        at, linear = settle(
            problem, at, weight, _STEPS_A_ROUND, _COARSE_DAMPING if turn == 0 else _FINE_DAMPING
        )
        residual_px = linear.residual_px
        floor_px = scatter.floor_px if turn > _LAST_FLOOR else None
        scatter = measure_scatter(observed, residual_px, len(at.lenses), floor_px)
        weight = point_weights(scatter, reject=turn > 0)
        motion = measure_motion(problem, at, linear, weight, motion, resting)
        change = np.abs(np.log(scatter.sigma_px / before.sigma_px)).max()
        if change < _FINE and abs(motion.dof - was.dof) < _FINE * motion.dof:
            break
    return Adjusted(problem, at, residual_px, scatter, weight, motion)


def _rounds(
    observed: Observations,
    target: Target,
    at: Unknowns,
    reference: int,
    stops: StageStops | None,
    free: Free,
    *,
    reject: bool,
) -> Adjusted:
    layout = lay_out(at.lenses, reference, free, stage=stops is not None)
    problem = Problem(observed, target, layout, stops)
    residual_px = residuals_px(observed, target, at)
    scatter = measure_scatter(observed, residual_px, len(at.lenses))
    for turn in range(_MOST_ROUNDS if reject else _MOST_COARSE_ROUNDS):
        before = scatter
        # Rejection waits until the scales have seen the fit once.
        weight = point_weights(scatter, reject=reject and turn > 0)
        at, linear = settle(
            problem, at, weight, _STEPS_A_ROUND, _COARSE_DAMPING if turn == 0 else _FINE_DAMPING
        )
        residual_px = linear.residual_px
        floor_px = scatter.floor_px if turn > _LAST_FLOOR else None
        scatter = measure_scatter(observed, residual_px, len(at.lenses), floor_px)
        change = np.abs(np.log(scatter.sigma_px / before.sigma_px)).max()
        if turn > 0 and change < (_FINE if reject else _COARSE):
            break
    return Adjusted(problem, at, residual_px, scatter, point_weights(scatter, reject=reject))


def fit_line(at: Unknowns, stops: StageStops) -> StageLine:
    """Straight line through the boards of the stage, positions against shifts."""
    away_mm = stops.position_mm - stops.middle_mm
    shift = at.board_shift_mm[stops.picture]
    design = np.stack([np.ones_like(away_mm), away_mm], axis=1)
    (origin, along), *_ = np.linalg.lstsq(design, shift, rcond=None)
    scale = float(np.sqrt(np.sum(along**2)))
    middle = int(np.argmin(np.abs(away_mm)))
    return StageLine(
        rotation=at.board_rotation[stops.picture[middle]],
        origin_mm=origin,
        axis=along / scale,
        scale=scale,
        middle_mm=stops.middle_mm,
    )
