"""Levenberg-Marquardt at fixed weights."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.geometry.calibration.linearise import Linearised, Target, linearise
from rig.geometry.calibration.normal import form
from rig.geometry.calibration.observations import Observations
from rig.geometry.calibration.priors import StageStops, pull_of_shared, stage_rows
from rig.geometry.calibration.unknowns import Layout, Unknowns

Float = NDArray[np.float64]

_FIRST_DAMPING = 1e-4
_LEAST_DAMPING = 1e-12
_MOST_DAMPING = 1e10
_SETTLED = 1e-8
"""Relative fall of the cost below which nothing is left to gain: of 40 000 residuals a fiftieth
of a sigma."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What stays the same while the unknowns move."""

    observed: Observations
    target: Target
    layout: Layout
    stops: StageStops | None


def settle(problem: Problem, start: Unknowns, weight: Float, most_steps: int) -> Unknowns:
    """Minimise the weighted squares from a start near the answer.

    K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems", DTU
    2004: damping falls with the gain ratio of a step and doubles its growth at each refusal.

    Args:
        problem: observations, board and layout.
        start: where to start; every weighted point before its camera.
        weight: (M,) inverse variances.
        most_steps: steps tried at most.
    """
    at, damping, growth = start, _FIRST_DAMPING, 2.0
    linear = linearise(problem.observed, problem.target, at)
    best, normal = _cost(problem, at, linear, weight), None
    for _ in range(most_steps):
        if normal is None:
            normal = form(
                problem.observed, problem.target, at, problem.layout, linear, weight, problem.stops
            )
        reduced = normal.reduced(damping)
        step = reduced.step() if reduced else None
        cost = np.inf
        if step:
            tried = at.moved(problem.layout, *step)
            there = linearise(problem.observed, problem.target, tried)
            cost = _cost(problem, tried, there, weight)
            if cost < best:
                gained = best - cost
                at, linear, best, normal = tried, there, cost, None
                damping, growth = max(damping / 10.0, _LEAST_DAMPING), 2.0
                if gained < _SETTLED * best:
                    break
                continue
        damping, growth = damping * growth, growth * 2.0
        if damping > _MOST_DAMPING or cost - best < _SETTLED * best:
            break
    return at


def _cost(problem: Problem, at: Unknowns, linear: Linearised, weight: Float) -> float:
    """Weighted squares of points, priors and stage; infinite where a point is behind a camera."""
    square = np.sum(linear.residual_px**2, axis=1)
    used = weight > 0
    cost = float(np.sum(square[used] * weight[used]))
    cost += pull_of_shared(at, problem.layout, problem.target).cost
    if problem.stops is not None:
        cost += float(np.sum(stage_rows(at, problem.stops).residual ** 2))
    return cost
