"""Levenberg-Marquardt at fixed weights."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.linearise import Linearised, Target, linearise, residuals_px
from rig.geometry.bundle.normal import follow_on, form
from rig.geometry.bundle.observations import Observations
from rig.geometry.bundle.priors import StageStops, pull_of_shared, stage_rows
from rig.geometry.bundle.unknowns import Layout, Unknowns

_LEAST_DAMPING, _MOST_DAMPING = 1e-12, 1e6
_LIGHT_DAMPING = 1e-8
"""Damping counts against the diagonal of the whole matrix. What the boards leave of it in the
weakest directions is smaller by many orders of magnitude, so a small gain under a damping above
this does not mean that nothing is left to gain."""
_FALL, _GROWTH = 30.0, 10.0
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
    tie: Float | None = None
    """(S, 6, 6) information that holds each sighting's motion near zero; None: boards at rest."""


def settle(
    problem: Problem,
    start: Unknowns,
    weight: Float,
    most_steps: int,
    damping: float = _LIGHT_DAMPING,
) -> tuple[Unknowns, Linearised]:
    """Minimise the weighted squares from a start near the answer.

    D. W. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM
    11(2), 1963: damping falls after every step that lowers the cost and grows until one does.

    Args:
        problem: observations, board and layout.
        start: where to start; every weighted point before its camera.
        weight: (M,) inverse variances.
        most_steps: steps taken at most; steps that are refused do not count.
        damping: to begin with; light near the answer, where the first step nearly reaches it.

    Returns:
        Where it settled, and residuals and derivatives there.
    """
    at, steps = start, 0
    linear = linearise(problem.observed, problem.target, at)
    best, normal = _cost(problem, at, linear.residual_px, weight), None
    while steps < most_steps and damping < _MOST_DAMPING:
        if normal is None:
            normal = form(
                problem.observed, problem.target, at, problem.layout, linear, weight, problem.stops,
                problem.tie,
            )  # fmt: skip
        reduced = normal.reduced(damping)
        step = reduced.step() if reduced else None
        if step is None:
            damping *= _GROWTH
            continue
        motion = follow_on(normal, problem.observed, problem.layout, *step)
        tried = at.moved(problem.layout, *step, motion)
        there_px = residuals_px(problem.observed, problem.target, tried)
        cost = _cost(problem, tried, there_px, weight)
        done = damping <= _LIGHT_DAMPING and abs(best - cost) < _SETTLED * best
        if cost < best:
            at, best, normal = tried, cost, None
            linear = linearise(problem.observed, problem.target, at, linear.jacobian)
            damping, steps = max(damping / _FALL, _LEAST_DAMPING), steps + 1
        else:
            damping *= _GROWTH
        if done:
            break
    return at, linear


def _cost(problem: Problem, at: Unknowns, residual_px: Float, weight: Float) -> float:
    """Weighted squares of points, priors and stage; infinite where a point is behind a camera."""
    square = np.sum(residual_px**2, axis=1)
    used = weight > 0
    cost = float(np.sum(square[used] * weight[used]))
    cost += pull_of_shared(at, problem.layout, problem.target).cost
    if problem.stops is not None:
        cost += float(np.sum(stage_rows(at, problem.stops).residual ** 2))
    if problem.tie is not None and at.motion is not None:
        cost += float(np.einsum("si,sij,sj->", at.motion, problem.tie, at.motion))
    return cost
