"""Residuals on pictures that the solve has not seen."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_side_by_side
from rig.geometry.bundle.adjust import Adjusted
from rig.geometry.bundle.priors import StageStops
from rig.geometry.bundle.settle import Problem, settle
from rig.geometry.bundle.unknowns import Free, lay_out

FOLDS = 5
_STEPS = 6


def held_out_residuals(adjusted: Adjusted) -> Float:
    """(M, 2) px: each picture against a solve of the others; only its board's pose is its own.

    Pictures go round the folds in their order, so that a slow drift is in all of them. Weights stay
    those of the whole solve, and each solve starts at its answer: what changes is a few percent of
    a sigma per picture, so a few Gauss-Newton steps settle it.
    """
    problem = adjusted.problem
    observed = problem.observed
    residual_px = np.empty_like(adjusted.residual_px)
    fold = np.arange(len(observed.pictures)) % min(FOLDS, len(observed.pictures))
    of_point = fold[observed.picture[observed.sighting_of_point]]

    def judge(number: int) -> None:
        out = fold == number
        weight = adjusted.weight[of_point != number]
        shown = out[observed.picture]
        taught, _ = settle(
            _part(problem, ~out), adjusted.at.with_boards(~out, ~shown), weight, _STEPS
        )
        unseen = _part(problem, out)
        layout = lay_out(taught.lenses, 0, Free(*[False] * 5), stage=unseen.stops is not None)
        unseen = replace(unseen, layout=layout)
        own = adjusted.at.with_boards(out, shown)
        start = replace(
            taught,
            board_rotation=own.board_rotation,
            board_shift_mm=own.board_shift_mm,
            motion=own.motion,
        )
        _, linear = settle(unseen, start, adjusted.weight[of_point == number], _STEPS)
        residual_px[of_point == number] = linear.residual_px

    run_side_by_side(*(partial(judge, number) for number in range(int(fold.max()) + 1)))
    return residual_px


def _part(problem: Problem, kept: NDArray[np.bool_]) -> Problem:
    """Return the problem of some of its pictures."""
    stops = problem.stops
    if stops is not None:
        on = kept[stops.picture]
        index = np.cumsum(kept) - 1
        stops = StageStops(index[stops.picture[on]], stops.position_mm[on])
    tie = problem.tie
    if tie is not None:
        tie = tie[kept[problem.observed.picture]]
    return replace(problem, observed=problem.observed.of_pictures(kept), stops=stops, tie=tie)


def picture_squares_px2(adjusted: Adjusted, residual_px: Float) -> Float:
    """(N,) mean squared length of each picture's residuals, outliers left out, freed of its pose.

    NaN where a picture has no more residuals than its pose has numbers.
    """
    observed = adjusted.problem.observed
    picture = observed.picture[observed.sighting_of_point]
    used = adjusted.weight > 0
    square = np.sum(residual_px**2, axis=1)
    size = len(observed.pictures)
    total = np.bincount(picture[used], weights=square[used], minlength=size)
    spare = 2 * np.bincount(picture[used], minlength=size) - 6.0
    return np.where(spare > 0, 2 * total / np.where(spare > 0, spare, 1), np.nan)
